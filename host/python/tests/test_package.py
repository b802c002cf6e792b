"""What a user of Python sees, beside the numbers."""

import doctest
import os
import pickle
import signal
import subprocess
import sys
import threading
import warnings

import numpy
import pandas
import pytest
import yawrig
from yawrig import _arrays, _model, _quantity, _record, _results, _trace, _verbs


@pytest.fixture(scope="module")
def record():
    made = yawrig.simulate(
        natural_frequency_rad_s=7, damping_ratio=0.006, seconds=16, rate_hz=100, effects=["coulomb_friction:c=0.15"]
    )
    return made.record


@pytest.fixture(scope="module")
def diagnosis(record):
    return yawrig.diagnose(record)


def test_examples_of_the_documentation():
    for module in [yawrig, _arrays, _model, _quantity, _record, _results, _trace, _verbs]:
        failed, _ = doctest.testmod(module)
        assert failed == 0
    assert doctest.testmod(_verbs).attempted > 3


def test_everything_has_a_docstring_and_is_typed():
    for name in yawrig.__all__:
        thing = getattr(yawrig, name)
        assert name == "__version__" or thing.__doc__, name
    for verb in [yawrig.identify, yawrig.diagnose, yawrig.compare, yawrig.law, yawrig.simulate, yawrig.read]:
        assert "return" in verb.__annotations__


@pytest.mark.parametrize("of", [list, tuple, numpy.array, pandas.Series, lambda a: numpy.array(a, dtype="f8")[::1]])
def test_any_numbers_in_a_row(record, of):
    expected = yawrig.identify(record.time_s, record.angle_deg).to_dict()
    assert yawrig.identify(of(record.time_s), of(record.angle_deg)).to_dict() == expected
    assert yawrig.identify((record.time_s, record.angle_deg)).to_dict() == expected


def test_strided_arrays_and_single_precision(record):
    both = numpy.column_stack([record.time_s, record.angle_deg])
    assert yawrig.identify(both[:, 0], both[:, 1]).to_dict() == yawrig.identify(record.time_s, record.angle_deg).to_dict()
    found = yawrig.identify(record.time_s, record.angle_deg.astype("f4"))
    assert abs(found.natural_frequency_rad_s.value - 7) < 0.05


def test_a_quantity(record):
    found = yawrig.identify(record)
    wn = found.natural_frequency_rad_s
    assert float(wn) == wn.value and wn.u > 0 and "\u00b1" in str(wn)
    value, u = wn
    assert (value, u) == (wn.value, wn.u)


def test_names_of_the_json_are_attributes(record, diagnosis):
    found = yawrig.identify(record, method="all")
    assert found.schema_version == 1 and found.file == "simulated"
    assert found.window.cycles == found.to_dict()["records"][0]["window"]["cycles"]
    assert [estimate.method for estimate in found.estimates] == ["least-squares", "conventional", "network"]
    assert found.at_amplitude[0].damping_ratio.u > 0
    assert {"window", "damping_ratio", "to_dict"} <= set(dir(found))
    with pytest.raises(AttributeError, match="natural_frequency_rad_s"):
        found.frequency
    assert diagnosis.parameters["coulomb_friction.c"].value == pytest.approx(0.15, rel=0.05)
    assert diagnosis.damping_ratio == diagnosis.modal.damping_ratio


def test_covariance(record, diagnosis):
    assert diagnosis.covariance.shape == (3, 3)
    at = diagnosis.covariance_names.index("coulomb_friction.c")
    u = diagnosis.parameters["coulomb_friction.c"].u
    assert diagnosis.covariance[at, at] ** 0.5 == pytest.approx(u, rel=1e-9)
    assert yawrig.identify(record).covariance is None


def test_model_and_residual(record, diagnosis):
    curves = diagnosis.curves
    assert curves.time_s.shape == curves.angle_deg.shape == diagnosis.residual.shape
    assert numpy.sqrt(numpy.mean(diagnosis.residual**2)) < 0.1
    # The same equation at the samples, in any order and shape.
    later = record.time_s > curves.time_s[0]
    angle = diagnosis.model(record.time_s[later][::-1])[::-1]
    assert numpy.std(angle - record.angle_deg[later]) < 0.1
    assert diagnosis.model(record.time_s[:4].reshape(2, 2)).shape == (2, 2)
    assert numpy.isnan(diagnosis.model(-1.0))
    # A second-order model misses the friction.
    plain = yawrig.compare(record)
    assert numpy.std(plain.residual) > 3 * numpy.std(diagnosis.residual)
    assert numpy.std(yawrig.identify(record).residual) > numpy.std(diagnosis.residual)


def test_tables(record, diagnosis):
    found = yawrig.identify(record).to_dataframe()
    assert found.natural_frequency_rad_s[0] > 6 and found.natural_frequency_rad_s_u[0] > 0
    assert list(diagnosis.to_dataframe().added)[1:] == ["coulomb_friction"]
    assert len(yawrig.compare([record, (record.time_s, record.angle_deg)]).to_dataframe()) == 2


def test_a_notebook_shows_sentence_table_and_pictures(diagnosis):
    page = diagnosis._repr_html_()
    assert page.startswith(f"<p><b>{diagnosis.sentence}</b></p><table>") and "explained" in diagnosis.sentence
    assert page.count("<svg") == len(diagnosis.pictures) >= 3
    assert "Residual over noise" in page and "<script" not in page
    assert repr(diagnosis) == f"<yawrig.Diagnosis: {diagnosis.sentence}>"


def test_what_a_result_shows_is_no_markup():
    t = numpy.arange(0, 20, 0.01)
    found = yawrig.identify(t, 12 * numpy.exp(-0.06 * t) * numpy.cos(6 * t), name="<img src=x>")
    assert "<img" not in found._repr_html_()


def test_plots(record, diagnosis, campaign):
    made = yawrig.simulate(natural_frequency_rad_s=7, damping_ratio=0.01, rate_hz=50)
    table = yawrig.Campaign.from_toml(campaign).derivatives()
    for result in [diagnosis, yawrig.identify(record), made, table]:
        figure = result.plot()
        figure.canvas.draw()
        assert figure.axes
    assert len(table.pictures) == 1 and len(table.to_dataframe()) == 8


def test_an_effect_of_ones_own(record):
    friction = yawrig.Effect("rubbing", "-c * tanh(r / 0.002)", {"c": {"unit": "rad/s2", "start": 0.05, "min": 0.0}})
    found = yawrig.compare(record, effects=[friction])
    assert found.effects == ["rubbing"]
    assert found.parameters["rubbing.c"].value == pytest.approx(0.15, rel=0.1)
    with pytest.raises(yawrig.YawrigError, match="rubbing"):
        yawrig.compare(record, effects=[yawrig.Effect("rubbing", "-c * nonsense(r)", {})])


def test_errors_have_the_sentence_of_the_program(program, record):
    t = numpy.arange(100) / 50.0
    with pytest.raises(yawrig.YawrigError, match="no free oscillation|oscillation") as raised:
        yawrig.identify(t, numpy.ones(100))
    assert "help:" in str(raised.value) and raised.value.exit_code == 3 and isinstance(raised.value, ValueError)
    with pytest.raises(yawrig.YawrigError, match="record, sample 4: not a finite number"):
        yawrig.identify(t, [0.0, 1.0, 2.0, float("inf")] + [0.0] * 96)
    with pytest.raises(yawrig.YawrigError, match="time runs"):
        yawrig.identify(t[::-1], t)
    with pytest.raises(yawrig.YawrigError, match="100 times and 99 angles"):
        yawrig.identify(t, t[1:])
    with pytest.raises(yawrig.YawrigError, match="dimensions"):
        yawrig.identify(t.reshape(2, 50), t.reshape(2, 50))
    with pytest.raises(yawrig.YawrigError, match="there is no effect") as raised:
        yawrig.compare(record, effects=["coulomb"])
    assert raised.value.exit_code == 2
    with pytest.raises(yawrig.YawrigError, match="cannot read missing.csv"):
        yawrig.read("missing.csv")
    with pytest.raises(yawrig.YawrigError, match="given twice"):
        yawrig.compare([record, record])
    with pytest.raises(yawrig.YawrigError, match="methodical"):
        yawrig.identify(record, method="methodical")
    said = program.run("identify", "missing.csv")
    with pytest.raises(yawrig.YawrigError) as raised:
        yawrig.identify("missing.csv")
    assert f"yawrig: {raised.value}" in said.stderr


def test_a_call_that_an_error_suggests_reads_the_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    t = numpy.arange(2000) / 100.0
    yaw = 10.0 * numpy.exp(-0.05 * t) * numpy.cos(6.0 * t)
    numpy.savetxt("camera.csv", numpy.column_stack([numpy.arange(2000), yaw]), delimiter=",", header="frame,theta", comments="")
    with pytest.raises(yawrig.YawrigError) as raised:
        yawrig.read("camera.csv")
    call = str(raised.value).split("help: ")[1].split("   (")[0]
    assert call == 'yawrig.read("camera.csv", time="frame", time_unit="samples", rate_hz=HZ, yaw="theta", unit="deg")'
    # What stands for a rate that only its user knows.
    assert len(eval(call, {"yawrig": yawrig, "HZ": 30})) == 2000


def test_a_record_that_cannot_be_used_does_not_stop_the_others(record):
    flat = yawrig.Record(record.time_s, numpy.zeros(len(record)), "flat")
    found = yawrig.identify_each([record, flat])
    assert [r.file for r in found.records] == ["simulated"] and found.refused[0].file == "flat"


def test_warnings_are_warnings(record):
    angle = record.angle_deg.copy()
    keep = numpy.ones(len(angle), dtype=bool)
    keep[700:760] = False
    with pytest.warns(yawrig.YawrigWarning):
        yawrig.diagnose(record.time_s[keep], angle[keep])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yawrig.diagnose(record)


def test_progress(record, campaign):
    told = []
    several = [yawrig.Record(record.time_s, record.angle_deg, f"r{k}") for k in range(20)]
    yawrig.identify_each(several, progress=lambda done, of: told.append((done, of)))
    yawrig.Campaign(campaign).derivatives(progress=lambda done, of: told.append((done, of)))
    assert told and told == sorted(told, key=lambda t: (t[1], t[0])) and {of for _, of in told} <= {20, 32}
    assert (20, 20) in told and (32, 32) in told

    def stop(done, of):
        raise KeyError("enough")

    with pytest.raises(KeyError, match="enough"):
        yawrig.identify_each(several, progress=stop)


def test_several_releases_in_a_record():
    one = yawrig.simulate(natural_frequency_rad_s=7, damping_ratio=0.03, rate_hz=100, seconds=30).record
    angle = numpy.concatenate([one.angle_deg, one.angle_deg])
    both = yawrig.Record(numpy.arange(len(angle)) / 100, angle, "both")
    parts = both.releases()
    assert [part.name for part in parts] == ["both#1", "both#2"]
    first, second = (yawrig.identify(part).natural_frequency_rad_s for part in parts)
    assert abs(first.value - second.value) < 3 * (first.u + second.u)
    assert one.releases() == [one]


def test_a_rate_is_fitted_as_a_rate_and_a_displacement_in_its_unit(tmp_path):
    """A damped oscillation of which a gyroscope shows the rate, in closed form; from arrays and from a file."""
    t = numpy.arange(0.0, 20.0, 0.01)
    wn, zeta = 6.0, 0.01
    wd = wn * (1 - zeta**2) ** 0.5
    decay = 0.2 * numpy.exp(-zeta * wn * t)
    noise = 1e-3 * numpy.random.default_rng(1).standard_normal(t.size)
    rate = decay * (-zeta * wn * numpy.cos(wd * t) - wd * numpy.sin(wd * t)) + noise
    gyroscope = yawrig.Record(t, rate, quantity="rate", unit="rad/s")
    assert (gyroscope.quantity, gyroscope.unit) == ("rate", "deg/s")
    file = tmp_path / "gyroscope.csv"
    with open(file, "w") as out:
        out.write("time (s),Gyroscope z (rad/s)\n")
        out.writelines(f"{a},{b}\n" for a, b in zip(t, rate))
    for record in [gyroscope, yawrig.read(file, quantity="rate"), pickle.loads(pickle.dumps(gyroscope))]:
        found = yawrig.identify(record)
        assert found.quantity == "rate"
        assert abs(found.natural_frequency_rad_s.value - wn) < 5 * found.natural_frequency_rad_s.u < 0.05
    with pytest.raises(yawrig.YawrigError, match="take its values"):
        gyroscope.angle_deg
    beam = yawrig.Record(t, 1e3 * decay * numpy.cos(wd * t), quantity="displacement", unit="mm")
    assert yawrig.identify(beam).unit == "mm" and beam.values.max() > 190
    with pytest.raises(yawrig.YawrigError, match="are no rate, and may be an angle"):
        yawrig.Record(t, rate, quantity="rate", unit="deg")


def test_a_ships_roll_in_the_coefficients_of_its_field():
    """B1 = 2 zeta wn A44; one release, two of one ship, and their law."""
    t = numpy.arange(0.0, 60.0, 0.02)
    rolls = [
        yawrig.Record(
            t,
            amplitude * numpy.exp(-0.02 * 2 * t) * numpy.cos(2 * (1 - 0.02**2) ** 0.5 * t)
            + 0.02 * numpy.random.default_rng(seed).standard_normal(t.size),
            name=f"roll{seed}",
            motion="roll",
        )
        for seed, amplitude in [(1, 14.0), (2, 9.0)]
    ]
    b1 = lambda roll: next(c for c in roll["coefficients"] if c["name"] == "B1")["of_ship"]["value"]
    one = yawrig.diagnose(rolls[0], inertia_kg_m2=50).to_dict()
    two = yawrig.diagnose(rolls, same_rig=True, inertia_kg_m2=50).to_dict()
    for roll in [one["roll"], *(record["roll"] for record in two["records"])]:
        assert abs(b1(roll) - 2 * 0.02 * 2 * 50) < 0.05
    law = yawrig.law(rolls[0], gm_m=0.1, displacement_kg=40).to_dict()["roll"]
    assert law["a44_kg_m2"]["value"] == pytest.approx(40 * 9.80665 * 0.1 / 4, rel=0.01)
    unnamed = yawrig.Record(t, rolls[0].values)
    with pytest.raises(yawrig.YawrigError, match='motion="roll"'):
        yawrig.diagnose([rolls[0], unnamed], inertia_kg_m2=50)
    with pytest.raises(yawrig.YawrigError, match="^inertia_kg_m2"):
        yawrig.diagnose(rolls[0], inertia_kg_m2=-50)


def test_results_and_records_travel(record, diagnosis):
    copy = pickle.loads(pickle.dumps(diagnosis))
    assert copy.to_dict() == diagnosis.to_dict() and copy.status == "explained"
    with pytest.raises(yawrig.YawrigError, match="where it was made"):
        copy.residual
    again = pickle.loads(pickle.dumps(record))
    assert yawrig.identify(again).to_dict() == yawrig.identify(record).to_dict()


def test_other_threads_go_on_meanwhile(record):
    turns, ended = [0], threading.Event()

    def count():
        while not ended.is_set():
            turns[0] += 1

    thread = threading.Thread(target=count)
    thread.start()
    before = turns[0]
    yawrig.diagnose(record)
    during = turns[0] - before
    ended.set()
    thread.join()
    # With Python's lock held there would be the few of its own switches.
    assert during > 1000


@pytest.mark.skipif(threading.current_thread() is not threading.main_thread(), reason="signals reach the main thread")
def test_ctrl_c_ends_what_is_going_on(record):
    begun = threading.Event()
    asked = threading.Thread(target=lambda: (begun.wait(), signal.raise_signal(signal.SIGINT)))
    asked.start()
    with pytest.raises(KeyboardInterrupt):
        begun.set()
        # Until it comes.
        while True:
            yawrig.diagnose(record)
    asked.join()
    # And all goes on after it.
    assert yawrig.identify(record).natural_frequency_rad_s.value > 6


def test_arrays_as_numpy_and_pandas_have_them(record):
    t, x = record.time_s, record.angle_deg
    wn = float(yawrig.identify(t, x).natural_frequency_rad_s)
    for unit in ["ms", "us", "ns"]:
        steps = numpy.round(t * {"ms": 1e3, "us": 1e6, "ns": 1e9}[unit]).astype("i8")
        for times in [steps.astype(f"m8[{unit}]"), numpy.datetime64("2024-01-01T10:00:00", unit) + steps.astype(f"m8[{unit}]")]:
            assert float(yawrig.identify(times, x).natural_frequency_rad_s) == pytest.approx(wn, abs=1e-4)
    times = pandas.to_datetime(numpy.round(t * 1e9).astype("i8"), utc=True)
    for table in [
        pandas.DataFrame({"note": 0.0, "yaw_deg": x, "time_s": t}),
        pandas.DataFrame({"time": times, "Yaw (deg)": x}),
        pandas.DataFrame({"Yaw (rad)": numpy.radians(x)}, index=times),
        pandas.Series(x, index=t),
        pandas.Series(x, index=times, name="yaw_deg"),
    ]:
        assert float(yawrig.identify(table).natural_frequency_rad_s) == pytest.approx(wn, abs=1e-4)
    with pytest.raises(yawrig.YawrigError, match="its channels: time_s .*, x "):
        yawrig.identify(pandas.DataFrame({"time_s": t, "x": x, "y": x}))


def test_what_is_masked_or_nan_is_a_gap(record):
    t, x = record.time_s, record.angle_deg
    mask = numpy.arange(len(t)) % 3 == 0
    bad = x + 3 * mask
    left_out = yawrig.identify(t[~mask], x[~mask])
    assert yawrig.identify(t, numpy.ma.array(bad, mask=mask)).to_dict() == left_out.to_dict()
    assert yawrig.identify(t, numpy.where(mask, numpy.nan, bad)).to_dict() == left_out.to_dict()
    with pytest.raises(yawrig.YawrigError, match="masked or NaN"):
        yawrig.identify(t, numpy.ma.array(x, mask=True))


def test_a_quantity_calculates():
    q, other = yawrig.Quantity(7.5, 0.02), yawrig.Quantity(2.0, 0.01)
    assert numpy.mean([q, q]) == 7.5 and (q * 2).u == pytest.approx(0.04) and float(2 * q) == 15.0
    assert (q - q).u == 0.0 and (q / q).u == pytest.approx(0.0, abs=1e-15)
    assert (q + other).u == pytest.approx(numpy.hypot(0.02, 0.01))
    assert (q * other).u == pytest.approx(numpy.hypot(2.0 * 0.02, 7.5 * 0.01))
    assert (q**2).u == pytest.approx(2 * 7.5 * 0.02) and (1 / q).u == pytest.approx(0.02 / 7.5**2)
    assert (q + yawrig.Quantity(1.0, None)).u is None and f"{q:.2f}" == "7.50" and -q < 0
    assert (numpy.array([1.0, 2.0]) * q).tolist() == [7.5, 15.0]


def test_a_process_that_was_forked_answers():
    code = """
import os, time, numpy, yawrig
t = numpy.arange(0, 20, 0.01)
x = 12 * numpy.exp(-0.09 * t) * numpy.cos(7.5 * t)
yawrig.identify(t, x)
pid = os.fork()
if pid == 0:
    yawrig.identify(t, x)
    os._exit(0)
print(os.waitpid(pid, 0)[1])
"""
    if not hasattr(os, "fork"):
        pytest.skip("there is no fork here")
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert ended.stdout.strip() == "0", ended.stderr


def test_the_loop_of_a_model_file_is_the_programs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    effects = ["coulomb_friction:c=0.1", "cubic_stiffness:k3=60"]
    made = yawrig.simulate(natural_frequency_rad_s=7, damping_ratio=0.006, effects=effects, rate_hz=200, seed=3)
    table = numpy.column_stack([made.record.time_s, made.record.angle_deg])
    numpy.savetxt("r.csv", table, fmt="%.17g", delimiter=",", header="time_s,yaw_deg", comments="")
    begun = yawrig.fit("model.toml", ["r.csv"])
    rubs = {"c": {"unit": "rad/s2", "start": 0.05, "min": 0.0}}
    rubbing = yawrig.Effect("rubbing", "-c * tanh(r / 0.002)", rubs)
    assert yawrig.reject("model.toml", "free_play", "no play by hand").rejected == "free_play"
    first = yawrig.add("model.toml", rubbing, why="it squeaks")
    assert first.residual_over_noise < begun.residual_over_noise
    both = yawrig.add("model.toml", "cubic_stiffness", source="mechanical")
    assert both.residual_over_noise < 1.1 and abs(both.parameters["cubic_stiffness.k3"] - 60) < 6
    less = yawrig.remove("model.toml", "cubic_stiffness")
    assert less.residual_over_noise == pytest.approx(first.residual_over_noise, rel=1e-6)
    steps = yawrig.history("model.toml", return_to=4, why="needed").steps
    assert [step.action for step in steps] == ["fit", "reject", "add", "add", "remove", "return"]
    assert steps[2].why == "it squeaks" and steps[3].command.startswith("yawrig add --model=model.toml")
    assert not yawrig.history("model.toml").edited
    assert yawrig.export("model.toml", "rig.py", to="python") == "rig.py"
    assert "def " in (tmp_path / "rig.py").read_text()
    page = yawrig.report("model.toml", "r.html", xlsx="r.xlsx")
    assert page.kind == "model" and (tmp_path / "r.html").exists() and (tmp_path / "r.xlsx").exists()
    with pytest.raises(yawrig.YawrigError, match="force"):
        yawrig.report("model.toml", "r.html")
    with pytest.raises(yawrig.YawrigError, match="each_wind"):
        yawrig.add("model.toml", "free_play", source="air")
