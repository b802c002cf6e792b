"""Writes the files beside it: one decaying swing in every format a rig's users have.

    pip install numpy scipy h5py npTDMS pyarrow xlwt odfpy
    apt install octave
    python3 make.py

300 samples at 100 Hz of  8 exp(-0.1 t) cos(2.5 pi t) + 0.5  degrees. The tests compute the same
and hold what is read against it. The TDMS files that npTDMS cannot write are put together here
byte for byte, and read back with npTDMS before they are kept.
"""

import struct
import subprocess
from pathlib import Path

import h5py
import numpy
import pyarrow
import pyarrow.parquet
import scipy.io
import xlwt
from nptdms import ChannelObject, TdmsFile, TdmsWriter
from odf.opendocument import OpenDocumentSpreadsheet
from odf.table import Table, TableCell, TableRow
from odf.text import P

here = Path(__file__).parent
count = 300
time_s = numpy.arange(count) / 100.0
yaw_deg = 8.0 * numpy.exp(-0.1 * time_s) * numpy.cos(2.5 * numpy.pi * time_s) + 0.5
yaw_rad = numpy.radians(yaw_deg)


def matlab():
    scipy.io.savemat(here / "v5.mat", {"time_s": time_s, "yaw_deg": yaw_deg, "name": "K4"})
    scipy.io.savemat(
        here / "v5-compressed.mat",
        {"t": time_s, "theta": yaw_rad.astype(numpy.float32), "both": numpy.ones((300, 2))},
        do_compression=True,
        oned_as="column",
    )
    # Scipy does not write 7.3: HDF5 behind MATLAB's block of 512 bytes, with its attributes.
    with h5py.File(here / "v73.mat", "w", userblock_size=512) as file:
        for name, values in [("time_s", time_s), ("yaw_deg", yaw_deg)]:
            data = file.create_dataset(name, data=values.reshape(1, count))
            data.attrs["MATLAB_class"] = numpy.bytes_("double")
    text = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Sat Nov 21 12:00:00 2026 HDF5 schema 1.00 ."
    with open(here / "v73.mat", "r+b") as file:
        file.write(text.ljust(116) + b"\0" * 8 + struct.pack("<HH", 0x0200, 0x4D49))


def cells():
    runs = numpy.empty(2, dtype=object)
    runs[0] = numpy.column_stack([time_s, yaw_deg])
    runs[1] = numpy.vstack([time_s, -yaw_deg])
    wide = numpy.vstack([time_s, yaw_rad])
    scipy.io.savemat(
        here / "cells.mat", {"runs": runs, "wide": wide, "name": "K4"}, do_compression=True
    )


def octave():
    program = """
        t = (0:299)' / 100;
        yaw = 8 * exp(-0.1 * t) .* cos(2.5 * pi * t) + 0.5;
        data = [t, pi / 180 * yaw];
        save('-v6', 'octave-matrix.mat', 'data');
        run.about = 'K4, wind off'; run.sensor.gain = 1;
        run.sensor.time_s = t'; run.sensor.yaw_deg = yaw';
        save('-v7', 'octave-struct.mat', 'run');
        runs = struct('time_s', {t, t}, 'yaw_deg', {yaw, -yaw});
        save('-v7', 'octave-structs.mat', 'runs');
    """
    subprocess.run(["octave-cli", "--eval", program], cwd=here, check=True)


def hdf5():
    with h5py.File(here / "groups.h5", "w") as file:
        for run, sign in [("run1", 1.0), ("run2", -1.0)]:
            group = file.create_group(run)
            group.create_dataset("time_s", data=time_s, compression="gzip", shuffle=True)
            yaw = group.create_dataset(
                "theta", data=sign * yaw_rad, chunks=(64,), compression="gzip"
            )
            yaw.attrs["units"] = "rad"
    with h5py.File(here / "new.h5", "w", libver="latest") as file:
        file["time_s"] = time_s.astype(">f8")
        file["yaw_rad"] = yaw_rad.astype("f4")
        file["note"] = "a text"


def tdms():
    half = count // 2
    waveform = {"wf_increment": 0.01, "wf_start_offset": 0.0, "unit_string": "deg"}
    with TdmsWriter(str(here / "waveform.tdms")) as writer:
        writer.write_segment([ChannelObject("Rig", "Yaw", yaw_deg[:half], waveform)])
        writer.write_segment([ChannelObject("Rig", "Yaw", yaw_deg[half:], waveform)])
    counts = numpy.round(1000 * yaw_deg).astype(numpy.int16)
    scale = {
        "NI_Scaling_Status": "unscaled",
        "NI_Number_Of_Scales": numpy.int32(1),
        "NI_Scale[0]_Scale_Type": "Linear",
        "NI_Scale[0]_Linear_Slope": 0.001,
        "NI_Scale[0]_Linear_Y_Intercept": 0.0,
    }
    with TdmsWriter(str(here / "scaled.tdms")) as writer:
        writer.write_segment(
            [
                ChannelObject("Rig", "time_s", time_s),
                ChannelObject("Rig", "yaw_deg", counts, scale),
            ]
        )


def tdms_bytes(flags, order, kinds, raw):
    """A segment with channels time_s and yaw_deg of these kinds, 100 values in a chunk."""
    text = lambda t: struct.pack(order + "I", len(t)) + t.encode()
    meta = struct.pack(order + "I", 2)
    for name, kind in zip(["time_s", "yaw_deg"], kinds):
        meta += text(f"/'Rig''s'/'{name}'") + struct.pack(order + "IIIQ", 20, kind, 1, 100)
        meta += struct.pack(order + "I", 0)
    lead = b"TDSm" + struct.pack("<I", flags)
    lead += struct.pack(order + "IQQ", 4713, len(meta) + len(raw), len(meta))
    return lead + meta + raw


def hand_made_tdms():
    meta, new, raw, interleaved, big = 2, 4, 8, 32, 64
    chunks = b"".join(
        time_s[i : i + 100].astype("<f8").tobytes() + yaw_deg[i : i + 100].astype("<f4").tobytes()
        for i in range(0, count, 100)
    )
    whole = tdms_bytes(meta | new | raw, "<", [10, 9], chunks)
    rows = numpy.empty(count, dtype=[("t", ">f8"), ("y", ">f8")])
    rows["t"], rows["y"] = time_s, yaw_deg
    flags = meta | new | raw | interleaved | big
    for name, content in [
        ("chunks.tdms", whole),
        ("interleaved.tdms", tdms_bytes(flags, ">", [10, 10], rows.tobytes())),
    ]:
        (here / name).write_bytes(content)
        group = TdmsFile.read(here / name)["Rig's"]
        assert numpy.array_equal(group["time_s"][:], time_s), name
        assert numpy.allclose(group["yaw_deg"][:], yaw_deg, atol=1e-6), name


def parquet():
    table = pyarrow.table({"time_s": time_s, "yaw_deg": yaw_deg, "spring": ["K4"] * count})
    pyarrow.parquet.write_table(table, here / "snappy.parquet", row_group_size=128)
    holes = [None if i == 7 else float(i) for i in range(count)]
    table = pyarrow.table(
        {"ms": pyarrow.array(range(0, 10 * count, 10), pyarrow.int64()),
         "t": pyarrow.array(time_s, pyarrow.float64()),
         "angle": pyarrow.array(yaw_rad, pyarrow.float32()),
         "holes": holes}
    )
    pyarrow.parquet.write_table(table, here / "zstd.parquet", compression="zstd")


def workbooks():
    rows = [("time_s", "yaw_deg")] + list(zip(time_s.tolist(), yaw_deg.tolist()))
    book = xlwt.Workbook()
    sheet = book.add_sheet("run")
    for k, row in enumerate(rows):
        for column, value in enumerate(row):
            sheet.write(k, column, value)
    book.save(here / "until-2003.xls")

    book = OpenDocumentSpreadsheet()
    table = Table(name="run")
    for row in rows:
        line = TableRow()
        for value in row:
            if isinstance(value, str):
                cell = TableCell(valuetype="string")
                cell.addElement(P(text=value))
            else:
                cell = TableCell(valuetype="float", value=repr(value))
            line.addElement(cell)
        table.addElement(line)
    book.spreadsheet.addElement(table)
    book.save(here / "sheet.ods")


matlab()
cells()
octave()
hdf5()
tdms()
hand_made_tdms()
parquet()
workbooks()
