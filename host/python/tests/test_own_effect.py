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
