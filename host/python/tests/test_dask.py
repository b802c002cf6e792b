"""The examples with Dask, at a small size: what one core gives, though a worker is lost."""

import pathlib

import pandas

EXAMPLES = pathlib.Path(__file__).parents[1] / "examples"


def test_a_cluster_gives_the_numbers_of_one_core_though_a_worker_is_lost(tmp_path, monkeypatch, capsys):
    monkeypatch.syspath_prepend(str(EXAMPLES))
    import dask_at_size
    import dask_records

    found, lost, alone = dask_at_size.at_size(14, tmp_path, per_file=3, again=1)
    assert len(lost) == 1 and "5 of 5 files" in capsys.readouterr().err
    assert list(found.record) == [f"r{k:05}" for k in range(14)] == list(alone.record)
    assert list(found.record[found.refused.notna()]) == ["r00005"] and (found.processor_s > 0).all()
    # Those with dry friction in them.
    assert list(alone.effects[[1, 6, 11]]) == ["coulomb_friction"] * 3
    # Each file by itself, and as it comes from Parquet.
    files = sorted(tmp_path.glob("*.parquet"))
    expected = pandas.concat([dask_records.judged(file) for file in files], ignore_index=True)
    pandas.testing.assert_frame_equal(found.drop(columns="processor_s"), expected, check_exact=True)
    expected.to_parquet(tmp_path / "results")
    pandas.testing.assert_frame_equal(pandas.read_parquet(tmp_path / "results"), expected, check_exact=True)
