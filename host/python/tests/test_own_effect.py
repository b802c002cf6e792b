"""An effect of one's own as a function of arrays: what is traced, and what cannot be."""

import math

import numpy
import pytest
import yawrig

C = {"c": {"unit": "rad/s2", "start": 0.05, "min": 0.0}}


@pytest.fixture(scope="module")
def record():
    made = yawrig.simulate(
        natural_frequency_rad_s=7, damping_ratio=0.006, seconds=16, rate_hz=100, effects=["coulomb_friction:c=0.15"]
    )
    return made.record


def moment(function, *names):
    return yawrig.Effect("own", function, {name: {"unit": "1", "start": 0.1} for name in names}).moment


def test_a_function_gives_the_numbers_of_its_expression(record):
    def rubbing(angle_rad, rate_rad_s, c):
        return -c * numpy.tanh(rate_rad_s / 0.002)

    found, written = (
        yawrig.compare(record, effects=[yawrig.Effect("rubbing", of, C)])
        for of in [rubbing, "-c * tanh(r / 0.002)"]
    )
    assert found.to_dict() == written.to_dict() and found.effects == ["rubbing"]
    assert found.parameters["rubbing.c"].value == pytest.approx(0.15, rel=0.1)
    angle_deg = found.model(record.time_s)
    assert numpy.isfinite(angle_deg).sum() > 1000
    assert numpy.array_equal(angle_deg, written.model(record.time_s), equal_nan=True)


def values(text, **at):
    """What an expression computes, by Python."""
    names = {
        "abs": numpy.abs, "sign": numpy.sign, "exp": numpy.exp, "ln": numpy.log, "sqrt": numpy.sqrt, "sin": numpy.sin,
        "cos": numpy.cos, "tanh": numpy.tanh, "atan2": numpy.arctan2, "min": numpy.minimum, "max": numpy.maximum,
    }
    return eval(text.replace("^", "**"), {**names, **at})


@pytest.mark.parametrize(
    "function",
    [
        lambda b, r, c: -c * b**3 - (b - (r - c)) / (b / (r / 2)),
        lambda b, r, c: (-b) ** 2 + -(b**2) - (b**2) ** c + 2.0**b + 1e-7 * r,
        lambda b, r, c: numpy.clip(b, -0.1, c) * numpy.sqrt(numpy.square(r) + 1) - -b + +r,
        lambda b, r, c: numpy.minimum(numpy.maximum(b - 0.1, 0), 1) + numpy.float64(0.3) * r * abs(r) - numpy.sign(b - r),
        lambda b, r, c: math.pi * numpy.exp(-abs(r) / c) * numpy.arctan2(b, -r) - numpy.log(c) * numpy.sin(b) / -3,
        lambda b, r, c: c / b / r - b * (r * c) - (b + r) + (c - b),
    ],
)
def test_the_expression_is_the_function(function):
    text = moment(function, "c")
    drawn = numpy.random.default_rng(1)
    b, r = drawn.uniform(-1, 1, 200), drawn.uniform(-1, 1, 200)
    assert (values(text, b=b, r=r, c=0.7) == function(b, r, 0.7)).all(), text


def test_in_place_and_every_input():
    def in_place(angle_rad, rate_rad_s, k, c, *, time_s, wind_m_s, natural_frequency_rad_s, eps=0.01):
        out = -k * angle_rad
        out += c * time_s
        out *= wind_m_s - eps
        return out / natural_frequency_rad_s

    assert moment(in_place, "c", "k") == "(-k * b + c * t) * (wind - 0.01) / wn"
    assert moment(lambda b, r, *p: -p[0] * b - p[1] * r, "k", "c") == "-k * b - c * r"
    assert moment(lambda b, r: 0.5) == "0.5"
    assert moment(numpy.arctan2) == "atan2(b, r)"


def branching(angle_rad, rate_rad_s, c):
    if angle_rad > 0:
        return -c * rate_rad_s
    return 0.0


def table(angle_rad, rate_rad_s, c):
    return numpy.interp(angle_rad, [0.0, 1.0], [0.0, 1.0])


@pytest.mark.parametrize(
    "function, reason",
    [
        (branching, "own: the moment branches on a value.*\n  help: say it with numpy.minimum"),
        (lambda b, r, c: numpy.where(r > 0, c, -c), "branches on a value"),
        (lambda b, r, c: c * (b and r), "branches on a value"),
        (lambda b, r, c: c * numpy.heaviside(b, 0.5), "branches on a value"),
        (lambda b, r, c: c * math.sin(b), "asked for a number"),
        (lambda b, r, c: c * b[0], "asked for a number"),
        (lambda b, r, c: sum(b) * c, "asked for a number"),
        (table, "uses numpy.interp|makes an array"),
        (lambda b, r, c: c * numpy.floor(b), "uses numpy.floor\n  help: a moment is made of"),
        (lambda b, r, c: c * numpy.add.reduce(b), "uses numpy.add.reduce"),
        (lambda b, r, c: c * b * numpy.array([1.0, 2.0]), "where a number stands"),
        (lambda b, r, c: c * b * float("nan"), "nan in it"),
        (lambda b, r, c: None, "None where a number stands|NoneType where a number stands"),
        (lambda b, r, c: c * numpy.random.default_rng().uniform(), "another one each time"),
        (lambda b, r, d: d * b, "takes d\n  help: def moment.*\\(c\\)"),
        (lambda b: b, "takes no yaw angle and yaw rate"),
    ],
)
def test_what_an_expression_cannot_say_is_refused_with_the_reason(function, reason):
    with pytest.raises(yawrig.YawrigError, match=reason):
        moment(function, "c")


def test_what_the_function_raises_comes_as_it_is():
    def broken(angle_rad, rate_rad_s):
        raise KeyError("no such thing")

    with pytest.raises(KeyError, match="no such thing"):
        moment(broken)
    with pytest.raises(AttributeError, match="uses .mean of an array"):
        moment(lambda b, r: b.mean())


def test_units_of_a_function_are_checked_too(record):
    wrong = yawrig.Effect("own", lambda b, r, c: c * r, C)
    with pytest.raises(yawrig.YawrigError, match="c \\* r"):
        yawrig.compare(record, effects=[wrong])


def late_release():
    """Held for a second; by Runge and Kutta: a moment -0.6 z that follows the rate, z' = (r - z) / 0.3; noise of 0.02 deg."""
    wn, zeta, c, t_s, step_s = 7.0, 0.006, 0.6, 0.3, 0.002

    def slope(y):
        b, r, z = y
        return numpy.array([r, -wn * wn * b - 2 * zeta * wn * r - c * z, (r - z) / t_s])

    y = numpy.array([math.radians(10), 0.0, 0.0])
    rows = [y[0]] * 500
    for _ in range(6000):
        rows.append(y[0])
        a = slope(y)
        b = slope(y + step_s / 2 * a)
        d = slope(y + step_s / 2 * b)
        e = slope(y + step_s * d)
        y = y + step_s / 6 * (a + 2 * b + 2 * d + e)
    noise = numpy.random.default_rng(7).normal(0.0, 0.02, len(rows))
    return numpy.arange(len(rows)) * step_s, numpy.degrees(rows) + noise


LATE = {"c": {"unit": "1/s", "start": 0.5, "min": 0.0}, "T": {"unit": "s", "start": 0.1, "min": 0.001}}


def test_a_moment_that_follows_late_has_a_state():
    def wake(angle_rad, rate_rad_s, z, c):
        return -c * z

    def follows(angle_rad, rate_rad_s, z, T):
        return (rate_rad_s - z) / T

    late = yawrig.Effect("wake", wake, LATE, states={"z": {"unit": "rad/s", "rate": follows}})
    written = yawrig.Effect("wake", "-c * z", LATE, states={"z": {"unit": "rad/s", "rate": "(r - z) / T"}})
    assert late.to_toml() == written.to_toml()
    assert 'rate = "(r - z) / T"' in late.to_toml()
    found = yawrig.compare(*late_release(), effects=[late])
    for name, planted in [("wake.c", 0.6), ("wake.T", 0.3)]:
        number = found.parameters[name]
        # Two numbers, each within 3 u: by chance 0.5 % of such tests fail.
        assert abs(number.value - planted) < 3 * number.u < 0.3 * planted, number
    assert found.residual_over_noise < 1.15
    with pytest.raises(yawrig.YawrigError, match="rate"):
        yawrig.compare(*late_release(), effects=[yawrig.Effect("wake", "-c * z", LATE, states={"z": {"unit": "rad/s"}})])
