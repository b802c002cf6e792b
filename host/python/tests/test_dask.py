"""The example with Dask gives what one core gives, though a worker is lost."""

import os
import pathlib
import signal

import pandas
import yawrig

EXAMPLES = pathlib.Path(__file__).parents[1] / "examples"


def test_a_cluster_gives_the_numbers_of_one_core_though_a_worker_is_lost(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(EXAMPLES))
    import dask_records
    from dask.distributed import Client

    for file in range(4):
        parts = []
        for k in range(3):
            made = yawrig.simulate(
                natural_frequency_rad_s=5 + file + k, damping_ratio=0.01, rate_hz=50, seconds=16, seed=3 * file + k + 1,
                effects=["coulomb_friction:c=0.15"] if k == 1 else [], name=f"r{file}{k}",
            ).record
            parts.append(pandas.DataFrame({"record": made.name, "time_s": made.time_s, "angle_deg": made.angle_deg}))
        # One that swings not at all.
        parts.append(pandas.DataFrame({"record": f"flat{file}", "time_s": made.time_s, "angle_deg": 0.0}))
        pandas.concat(parts).to_parquet(tmp_path / f"{file}.parquet")
    files = sorted(tmp_path.glob("*.parquet"))
    expected = pandas.concat([dask_records.judged(file) for file in files], ignore_index=True)
    assert len(expected) == 16 and expected.refused.notna().sum() == 4
    assert list(expected.effects[[1, 5]]) == ["coulomb_friction"] * 2

    told = []
    with dask_records.cluster(2) as cluster, Client(cluster) as client:

        def progress(done, of):
            if not told:
                # Whatever it is doing now.
                os.kill(next(iter(client.run(os.getpid).values())), signal.SIGKILL)
            told.append((done, of))

        found = dask_records.run(files, client, progress)
    pandas.testing.assert_frame_equal(found, expected, check_exact=True)
    assert told == [(k, 4) for k in range(1, 5)]
    found.to_parquet(tmp_path / "results.parquet")
    pandas.testing.assert_frame_equal(pandas.read_parquet(tmp_path / "results.parquet"), expected, check_exact=True)
