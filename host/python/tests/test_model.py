"""The model of a record as a function of time, and as the right-hand side of its equation."""

import pickle

import numpy
import pytest
import yawrig
from scipy.integrate import solve_ivp


def released(*effects, seconds=12, natural_frequency_rad_s=7, name="simulated", seed=1):
    return yawrig.simulate(
        natural_frequency_rad_s=natural_frequency_rad_s, damping_ratio=0.006, seconds=seconds, rate_hz=100, name=name,
        seed=seed, effects=list(effects),
    ).record


def integrated(model, end_s, **how):
    """Instants, and what the model reads there, by scipy's integrator."""
    time_s = numpy.linspace(model.start_s, end_s, 400)
    how = {"method": "DOP853", "rtol": 1e-9, "atol": 1e-9, **how}
    solved = solve_ivp(model.rhs, (time_s[0], end_s), model.initial_state, t_eval=time_s, **how)
    assert solved.success
    return time_s, model.reading(solved.t, solved.y)


@pytest.mark.parametrize(
    "effects",
    [
        [],
        ["cubic_stiffness", "quadratic_damping"],
        ["harmonic_forcing", "sensor_nonlinearity"],
        ["static_offset", "stiffness_drift", "baseline_drift"],
    ],
)
def test_scipy_integrates_it_to_the_model_as_nearly_as_it_is_asked(effects):
    record = released("cubic_stiffness:k3=60", "quadratic_damping:d=0.2")
    model = yawrig.compare(record, effects=effects).model
    for tolerance, within_deg in [(1e-5, 5e-3), (1e-7, 1e-4), (1e-9, 1e-5)]:
        time_s, angle_deg = integrated(model, record.time_s[-1], rtol=tolerance, atol=tolerance)
        assert numpy.abs(angle_deg - model(time_s)).max() < within_deg
    assert numpy.abs(model(time_s)).max() > 1


def test_of_own_effects_and_the_sensors_zero():
    record = released("cubic_stiffness:k3=60")
    drag = yawrig.Effect("drag", lambda b, r, d: -d * r * abs(r), {"d": {"unit": "1", "start": 0.01, "min": 0.0}})
    model = yawrig.compare(record, effects=["cubic_stiffness", drag], unknown_zero=True).model
    time_s, angle_deg = integrated(model, record.time_s[-1])
    assert numpy.abs(angle_deg - model(time_s)).max() < 1e-5


def test_dry_friction_and_hysteresis_are_in_it():
    record = released("coulomb_friction:c=0.1", "cubic_stiffness:k3=60")
    model = yawrig.compare(record, effects=["coulomb_friction", "cubic_stiffness"]).model
    time_s, angle_deg = integrated(model, model.start_s + 8, max_step=0.01)
    assert numpy.abs(angle_deg - model(time_s)).max() < 3e-4
    # Held at rest.
    assert (model.rhs(model.start_s, [1e-3, 0.0]) == 0.0).all() and (model.rhs(model.start_s, [5.0, 0.0]) != 0.0).any()

    record = released("hysteresis:h=15,y=0.03")
    model = yawrig.compare(record, effects=["hysteresis"]).model
    assert model.state_units == ["deg", "deg/s", "deg"] and model.initial_state.shape == (3,)
    time_s, angle_deg = integrated(model, model.start_s + 8, max_step=0.01)
    assert numpy.abs(angle_deg - model(time_s)).max() < 1e-5


def test_shapes_and_what_is_refused():
    record = released()
    model = yawrig.identify(record).model
    assert repr(model) == f"<yawrig.Model of simulated from {model.start_s:.3f} s>"
    state = numpy.array([[1.0, 2.0, 3.0], [0.0, 1.0, -1.0]])
    both = model.rhs([1.0, 2.0, 3.0], state)
    assert both.shape == (2, 3) and (both[:, 1] == model.rhs(2.0, [2.0, 1.0])).all() and (both[0] == state[1]).all()
    assert (model.rhs(0.0, state) == both).all()
    assert model.reading(1.0, [1.5, 0.0]) == pytest.approx(1.5) and model.reading([1.0, 2.0, 3.0], state).shape == (3,)
    assert model.reading(model.start_s, model.initial_state) == pytest.approx(float(model(model.start_s)), abs=1e-9)
    for wrong in [[1.0], [1.0, 2.0, 3.0], 1.0]:
        with pytest.raises(yawrig.YawrigError, match="this model's has 2 numbers \\(deg, deg/s\\)"):
            model.rhs(0.0, wrong)
    # One that asks for whole arrays at once.
    solved = solve_ivp(model.rhs, (model.start_s, 4.0), model.initial_state, method="Radau", vectorized=True, rtol=1e-6)
    assert model.reading(4.0, solved.y[:, -1]) == pytest.approx(float(model(4.0)), abs=0.01)


def test_a_random_moment_has_no_right_hand_side():
    record = released("buffeting:q=0.02", seconds=30)
    found = yawrig.diagnose(record)
    assert found.effects[0] == "buffeting"
    with pytest.raises(yawrig.YawrigError, match="buffeting is random.*\n  help: compare"):
        found.model.rhs(1.0, found.model.initial_state)
    assert yawrig.compare(record).model.rhs(1.0, [1.0, 0.0]).shape == (2,)


def follows_its_record(model, record):
    """That the model is of this record and of no other."""
    curves = model.curves
    assert numpy.std(model.residual) < 0.1 < numpy.std(curves.angle_deg)
    later = record.time_s > curves.time_s[0]
    assert numpy.std(model(record.time_s[later]) - record.angle_deg[later]) < 0.1
    time_s, angle_deg = integrated(model, model.start_s + 5, max_step=0.01)
    assert numpy.abs(angle_deg - model(time_s)).max() < 1e-3


def test_several_records_have_a_model_each(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    records = [
        released("coulomb_friction:c=0.15", natural_frequency_rad_s=7 + k, seconds=16, name=f"r{k}.csv", seed=k + 1)
        for k in range(2)
    ]
    for record in records:
        both = numpy.column_stack([record.time_s, record.angle_deg])
        numpy.savetxt(record.name, both, fmt="%.17g", delimiter=",", header="time_s,yaw_deg", comments="")
    diagnosis = yawrig.diagnose(records)
    assert diagnosis.effects == ["coulomb_friction"]
    fitted = yawrig.fit("m.toml", ["r0.csv"], hold_out=["r1.csv"])
    found = [diagnosis, yawrig.compare(records, effects=["coulomb_friction"])]
    for result in found:
        assert [model.name for model in result.models] == ["r0.csv", "r1.csv"] == [r.file for r in result.records]
        for model, record in zip(result.models, records):
            follows_its_record(model, record)
        # The friction is shared.
        frictions = [model.rhs(0.0, [0.0, 1e-9])[1] for model in result.models]
        assert frictions[0] == pytest.approx(frictions[1], rel=1e-6)
        assert frictions[0] == pytest.approx(-numpy.degrees(0.15), rel=0.05)
        with pytest.raises(yawrig.YawrigError, match="models of 2 records, not of one\n  help: .models has one for each"):
            result.model
    assert [model.name for model in fitted.models] == ["r0.csv", "r1.csv"]
    assert numpy.std(fitted.models[0].residual) < 1 < numpy.std(fitted.models[0].curves.angle_deg)
    alone = yawrig.fit("n.toml", ["r0.csv"])
    assert alone.model.name == "r0.csv" and (alone.residual == fitted.models[0].residual).all()


def test_where_there_is_no_model():
    record = released()
    for result in [yawrig.law(record), yawrig.identify_each([record, released(name="b")])]:
        assert result.models == []
        with pytest.raises(yawrig.YawrigError, match="no model of a record"):
            result.model
    copy = pickle.loads(pickle.dumps(yawrig.identify(record)))
    with pytest.raises(yawrig.YawrigError, match="where it was made"):
        copy.model
