"""A number with its uncertainty."""

from __future__ import annotations

import math
from typing import Any, Dict, Iterator, Optional, Tuple


class Quantity(float):
    """A value and its standard uncertainty (k = 1), both in the unit that the name says; u is None where there is none.

    It is a number, its value. Sums, products and powers of quantities have uncertainties, too, to first order: of what is the
    same quantity twice, the whole; of others as if they were independent.

    >>> q = Quantity(7.5, 0.02)
    >>> q * 2
    Quantity(value=15.0, u=0.04)
    >>> (q - q).u, (q + Quantity(1.0, 0.02)).u == math.hypot(0.02, 0.02)
    (0.0, True)
    """

    #: Its number; None where there is none.
    value: Optional[float]
    #: Its standard uncertainty.
    u: Optional[float]
    _parts: Dict[Any, float]

    def __new__(
        cls, value: Optional[float], u: Optional[float] = None, parts: Optional[Dict[Any, float]] = None
    ) -> "Quantity":
        self = super().__new__(cls, math.nan if value is None else value)
        self.value, self.u = value, u
        # What each independent number adds to it, with its sign.
        self._parts = ({object(): u} if u else {}) if parts is None else parts
        return self

    def _with(self, other: Any, value: Any, own: Any, others: Any) -> "Quantity":
        """``value(a, b)``, by its derivatives to a and b."""
        if not isinstance(other, (int, float)):
            return NotImplemented
        a, b = float(self), float(other)
        result = value(a, b)
        of = (self, own(a, b)), (other, others(a, b) if isinstance(other, Quantity) else 0.0)
        if any(isinstance(q, Quantity) and q.u is None for q, _ in of):
            return Quantity(result, None)
        parts: Dict[Any, float] = {}
        for quantity, slope in of:
            for key, part in getattr(quantity, "_parts", {}).items():
                parts[key] = parts.get(key, 0.0) + slope * part
        return Quantity(result, math.hypot(*parts.values()), parts)

    def __add__(self, other: Any) -> Any:
        return self._with(other, lambda a, b: a + b, lambda a, b: 1.0, lambda a, b: 1.0)

    def __sub__(self, other: Any) -> Any:
        return self._with(other, lambda a, b: a - b, lambda a, b: 1.0, lambda a, b: -1.0)

    def __rsub__(self, other: Any) -> Any:
        return self._with(other, lambda a, b: b - a, lambda a, b: -1.0, lambda a, b: 1.0)

    def __mul__(self, other: Any) -> Any:
        return self._with(other, lambda a, b: a * b, lambda a, b: b, lambda a, b: a)

    def __truediv__(self, other: Any) -> Any:
        return self._with(other, lambda a, b: a / b, lambda a, b: 1.0 / b, lambda a, b: -a / b**2)

    def __rtruediv__(self, other: Any) -> Any:
        return self._with(other, lambda a, b: b / a, lambda a, b: -b / a**2, lambda a, b: 1.0 / a)

    def __pow__(self, other: Any, modulo: None = None) -> Any:
        def by_exponent(a: float, b: float) -> float:
            return a**b * math.log(a) if a > 0 else math.nan

        return self._with(other, lambda a, b: a**b, lambda a, b: b * a ** (b - 1.0), by_exponent)

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self) -> "Quantity":
        return self * -1.0

    def __pos__(self) -> "Quantity":
        return self

    def __abs__(self) -> "Quantity":
        return -self if self < 0 else self

    def __iter__(self) -> Iterator[Optional[float]]:
        # ``value, u = quantity``
        return iter((self.value, self.u))

    def __reduce__(self) -> Tuple[Any, ...]:
        return Quantity, (self.value, self.u)

    def __repr__(self) -> str:
        return f"Quantity(value={self.value!r}, u={self.u!r})"

    def __str__(self) -> str:
        return f"{float(self):.6g} \u00b1 " + ("?" if self.u is None else f"{self.u:.2g}")

    def __format__(self, spec: str) -> str:
        return format(float(self), spec) if spec else str(self)
