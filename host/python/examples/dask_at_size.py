"""What dask_records.py costs at its size: many simulated records on two workers of this machine, one of them lost on the way.

    python dask_at_size.py [RECORDS] [FOLDER]

RECORDS (10000) records, two hundred to a Parquet file, are written into FOLDER (a temporary one), identified and diagnosed.
Once half of the files are done a worker is killed. Every tenth file is then judged again on one core: the numbers must be the
same to the bit. Prints the processor time that a record took.
"""

import os
import pathlib
import signal
import sys
import tempfile
import time

import dask_records
import pandas
import yawrig
from dask.distributed import Client

EFFECTS = [[], ["coulomb_friction:c=0.1"], ["cubic_stiffness:k3=60"], ["quadratic_damping:d=0.2"], ["static_offset:m=0.3"]]


def made(file, numbers):
    """Writes the records of these numbers, each of another rig; one of fifty swings not at all."""
    parts = []
    for k in numbers:
        record = yawrig.simulate(
            natural_frequency_rad_s=5 + k % 97 / 20, damping_ratio=0.005 + k % 13 / 1000, effects=EFFECTS[k % len(EFFECTS)],
            seconds=16, rate_hz=50, seed=k + 1, name=f"r{k:05}",
        ).record
        angle_deg = 0 * record.angle_deg if k % 50 == 5 else record.angle_deg
        parts.append(pandas.DataFrame({"record": record.name, "time_s": record.time_s, "angle_deg": angle_deg}))
    pandas.concat(parts).to_parquet(file)


def timed(file):
    """The results of a file, and the processor time of each of its records, s."""
    begin = time.process_time()
    rows = dask_records.judged(file)
    return rows.assign(processor_s=(time.process_time() - begin) / len(rows))


def at_size(records, folder, per_file=200, again=10):
    """The results, the workers that were lost, and the results of every ``again``th file on one core."""
    groups = [range(first, min(first + per_file, records)) for first in range(0, records, per_file)]
    files = [folder / f"{k:04}.parquet" for k in range(len(groups))]
    lost = []
    with dask_records.cluster(2) as cluster, Client(cluster) as client:
        client.gather(client.map(made, files, groups))

        def progress(done, of):
            print(f"\r{done} of {of} files", end="", file=sys.stderr)
            if not lost and 2 * done >= of:
                lost.append(next(iter(client.run(os.getpid).values())))
                os.kill(lost[0], signal.SIGKILL)

        found = dask_records.run(files, client, progress, timed)
    alone = pandas.concat([dask_records.judged(file) for file in files[::again]], ignore_index=True)
    same = found[found.record.isin(alone.record)].drop(columns="processor_s").reset_index(drop=True)
    pandas.testing.assert_frame_equal(same[alone.columns], alone, check_exact=True)
    return found, lost, alone


if __name__ == "__main__":
    records = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else temporary)
        begin = time.monotonic()
        found, lost, alone = at_size(records, folder)
        found.drop(columns="processor_s").to_parquet(folder / "results.parquet")
        print(f"\n{len(found)} records on 2 workers, {len(lost)} lost, in {time.monotonic() - begin:.0f} s with all that is around it")
        print(f"{1e3 * found.processor_s.mean():.0f} ms of processor time a record; {len(alone)} judged again: same to the bit")
        print(found.groupby(found.status.fillna("refused")).size().to_string())
