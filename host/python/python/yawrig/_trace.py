"""A moment written as a function, traced: called once with what writes itself down, it gives the expression it computes.

The expression is what the program compiles, so that the moment is as quick as one written as text, works without Python's
lock, is checked for its units and can be kept in a file.
"""

from __future__ import annotations

import inspect
from typing import Any, Callable, Dict, List, NoReturn, Sequence, Tuple

import numpy

from ._native import YawrigError

#: How tightly what is written holds together: sums, products, a sign, powers, names and calls.
SUM, PRODUCT, SIGN, POWER, WHOLE = 5, 7, 9, 11, 20
OPERATORS = {
    numpy.add: ("+", SUM), numpy.subtract: ("-", SUM), numpy.multiply: ("*", PRODUCT), numpy.divide: ("/", PRODUCT),
    numpy.power: ("^", POWER), numpy.float_power: ("^", POWER),
}
FUNCTIONS = {
    numpy.absolute: "abs", numpy.fabs: "abs", numpy.sign: "sign", numpy.exp: "exp", numpy.log: "ln", numpy.log10: "log10",
    numpy.sqrt: "sqrt", numpy.sin: "sin", numpy.cos: "cos", numpy.tan: "tan", numpy.arcsin: "asin", numpy.arccos: "acos",
    numpy.arctan: "atan", numpy.sinh: "sinh", numpy.cosh: "cosh", numpy.tanh: "tanh", numpy.arctan2: "atan2",
    numpy.minimum: "min", numpy.maximum: "max", numpy.fmin: "min", numpy.fmax: "max",
}
#: What a function may take beside angle, rate and its parameters, and what that is called in an expression.
INPUTS = {"time_s": "t", "natural_frequency_rad_s": "wn", "wind_m_s": "wind"}
CAN = "+ - * / **, and of numpy " + ", ".join(sorted({f.__name__ for f in [*FUNCTIONS, numpy.square, numpy.negative]} | {"clip"}))


def refused(what: str) -> NoReturn:
    """Whatever cannot be written as an expression."""
    raise YawrigError(f"{what}\n  help: a moment is made of {CAN}")


def _branches(*_: Any) -> NoReturn:
    raise YawrigError(
        "the moment branches on a value (if, and, or, a comparison, numpy.where), and an expression has no branches\n"
        "  help: say it with numpy.minimum, maximum, clip, abs or sign: max(x, 0) is x where that is positive, else 0"
    )


def _is_a_symbol(*_: Any) -> NoReturn:
    refused("the moment is asked for a number where it has none yet (math, float, int, an index, a loop over an array)")


class Traced(numpy.lib.mixins.NDArrayOperatorsMixin):
    """Stands for an array in a function that is traced."""

    def __init__(self, text: str, holds: int = WHOLE) -> None:
        self._text, self._holds = text, holds

    def _within(self, least: int) -> str:
        return self._text if self._holds >= least else f"({self._text})"

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        name = getattr(ufunc, "__name__", str(ufunc))
        if ufunc in COMPARISONS:
            _branches()
        out = options.pop("out", ())
        if method != "__call__" or options:
            refused(f"the moment uses numpy.{name}{'.' + method if method != '__call__' else ' with ' + ', '.join(options)}")
        made = _called(ufunc, [traced(value) for value in inputs])
        if not out:
            return made
        # In place, as numpy does it: every other name of this array sees it.
        (place,) = out
        place._text, place._holds = made._text, made._holds
        return place

    def __array_function__(self, function: Any, types: Any, arguments: Tuple[Any, ...], options: Dict[str, Any]) -> Any:
        if function is numpy.clip:
            return _clip(*arguments, **options)
        if function in (numpy.where, numpy.select, numpy.piecewise):
            _branches()
        refused(f"the moment uses numpy.{function.__name__}")

    def __array__(self, *_: Any, **__: Any) -> NoReturn:
        refused("the moment makes an array of what it is given")

    def __getattr__(self, name: str) -> NoReturn:
        raise AttributeError(f"the moment uses .{name} of an array\n  help: a moment is made of {CAN}")

    __bool__ = _branches
    __float__ = __int__ = __index__ = __complex__ = __iter__ = __len__ = __getitem__ = _is_a_symbol
    __hash__ = None  # type: ignore[assignment]


COMPARISONS = {
    numpy.less, numpy.less_equal, numpy.greater, numpy.greater_equal, numpy.equal, numpy.not_equal, numpy.logical_and,
    numpy.logical_or, numpy.logical_not, numpy.logical_xor, numpy.isnan, numpy.isfinite, numpy.isinf, numpy.signbit,
    numpy.heaviside, numpy.copysign,
}


def _called(ufunc: Any, inputs: Sequence[Traced]) -> Traced:
    a = inputs[0]
    if ufunc in OPERATORS:
        sign, holds = OPERATORS[ufunc]
        # What stands to the right keeps its parentheses, a - (b - c), and all that a power is of, (a ** b) ** c.
        left, right = (WHOLE, WHOLE) if holds == POWER else (holds, holds + 1)
        return Traced(f"{a._within(left)} {sign} {inputs[1]._within(right)}", holds)
    if ufunc in FUNCTIONS:
        return Traced(f"{FUNCTIONS[ufunc]}({', '.join(x._text for x in inputs)})")
    if ufunc is numpy.negative:
        return Traced(f"-{a._within(SIGN + 1)}", SIGN)
    if ufunc is numpy.positive:
        return Traced(a._text, a._holds)
    if ufunc is numpy.square:
        return Traced(f"{a._within(WHOLE)} ^ 2", POWER)
    refused(f"the moment uses numpy.{ufunc.__name__}")


def _clip(a: Any, a_min: Any = None, a_max: Any = None, *, min: Any = None, max: Any = None) -> Any:
    low, high = (a_min if min is None else min), (a_max if max is None else max)
    above = a if low is None else numpy.maximum(a, low)
    return above if high is None else numpy.minimum(above, high)


def traced(value: Any) -> Traced:
    """A symbol, or a number written down."""
    if isinstance(value, Traced):
        return value
    if isinstance(value, (bool, numpy.bool_, str, bytes)) or not numpy.isscalar(value) and getattr(value, "shape", None) != ():
        refused(f"the moment uses {type(value).__name__} where a number stands")
    try:
        number = float(value)
    except (TypeError, ValueError):
        refused(f"the moment uses {value!r} where a number stands")
    if not numpy.isfinite(number):
        refused(f"the moment has {number} in it")
    # As short as it can be and still the same number.
    text = repr(abs(number))
    text = text[:-2] if text.endswith(".0") else text
    return Traced(f"-{text}", SIGN) if number < 0.0 or str(number) == "-0.0" else Traced(text)


def expression(moment: Callable[..., Any], parameters: Sequence[str], id: str) -> str:
    """What ``moment(angle_rad, rate_rad_s, ...)`` computes.

    Raises
    ------
    YawrigError
        With the reason why an expression cannot say it. What the function itself raises comes as it is.
    """
    positional, named = _arguments(moment, parameters, id)

    def once() -> str:
        with numpy.errstate(all="ignore"):
            return traced(moment(*map(Traced, positional), **{k: Traced(v) for k, v in named.items()}))._text

    try:
        first = once()
        if once() != first:
            refused("the moment is another one each time it is called: an effect is of angle, rate and its parameters alone")
    except YawrigError as error:
        raise YawrigError(f"{id}: {error}") from None
    return first


def _arguments(moment: Callable[..., Any], parameters: Sequence[str], id: str) -> Tuple[List[str], Dict[str, str]]:
    """What stands in the expression for each argument of ``moment``, those by place and those by name."""
    known = {**INPUTS, **{name: name for name in parameters}}
    try:
        given = list(inspect.signature(moment).parameters.values())
    except (TypeError, ValueError):
        return ["b", "r", *parameters], {}
    by_place = [p for p in given if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]
    others = by_place[2:] + [p for p in given if p.kind is p.KEYWORD_ONLY]
    takes_all = any(p.kind is p.VAR_POSITIONAL for p in given)
    unknown = [p.name for p in others if p.name not in known and p.default is p.empty]
    if unknown or len(by_place) < 2 and not takes_all:
        what = f"takes {', '.join(unknown)}" if unknown else "takes no yaw angle and yaw rate"
        raise YawrigError(
            f"{id}: the moment {what}\n  help: def moment(angle_rad, rate_rad_s, ...) with the names of its parameters"
            f"{' (' + ', '.join(parameters) + ')' if parameters else ''}, and of {', '.join(INPUTS)} what it needs"
        )
    named = {p.name: known[p.name] for p in others if p.name in known}
    if not takes_all:
        return ["b", "r"], named
    first = [known[p.name] for p in by_place[2:] if p.name in known]
    rest = [name for name in parameters if name not in named]
    return ["b", "r", *first, *rest], {p.name: known[p.name] for p in given if p.kind is p.KEYWORD_ONLY and p.name in known}
