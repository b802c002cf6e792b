"""Many records on many machines, with Dask: each identified and diagnosed, from Parquet to Parquet.

    python dask_records.py FOLDER RESULTS.parquet [SCHEDULER]

FOLDER holds Parquet files of some hundred records each, with the columns record, time_s and angle_deg. Without the address of
a scheduler the work is done by this machine's cores. A file is a task: where a worker is lost, its files are done again.
"""

import pathlib
import sys

import pandas
import yawrig
from dask.distributed import Client, LocalCluster, as_completed


def judged(file):
    """The results of the records in a file, a row for each; what cannot be used has the reason under ``refused``."""
    rows = []
    for name, samples in pandas.read_parquet(file).groupby("record", sort=False):
        row = {"record": name}
        try:
            record = yawrig.Record(samples.time_s, samples.angle_deg, name)
            found, diagnosis = yawrig.identify(record), yawrig.diagnose(record)
            for quantity in ["natural_frequency_rad_s", "damping_ratio"]:
                row[quantity], row[f"{quantity}_u"] = found[quantity]
            row["status"], row["effects"] = diagnosis.status, " ".join(diagnosis.effects)
        except yawrig.YawrigError as error:
            row["refused"] = str(error)
        rows.append(row)
    return pandas.DataFrame(rows)


def run(files, client, progress=lambda done, of: None, work=judged):
    """All results, in the order of the files."""
    futures = client.map(work, [str(file) for file in files], retries=3, pure=False)
    for done, _ in enumerate(as_completed(futures), start=1):
        progress(done, len(futures))
    return pandas.concat(client.gather(futures), ignore_index=True)


def cluster(workers=None):
    """This machine's cores, a worker each: yawrig is told to take one, too."""
    return LocalCluster(n_workers=workers, threads_per_worker=1, env={"RAYON_NUM_THREADS": "1"}, dashboard_address=None)


if __name__ == "__main__":
    folder, out, *scheduler = sys.argv[1:]
    with Client(*scheduler) if scheduler else Client(cluster()) as client:
        shown = lambda done, of: print(f"\r{done} of {of} files", end="", file=sys.stderr)
        run(sorted(pathlib.Path(folder).glob("*.parquet")), client, shown).to_parquet(out)
