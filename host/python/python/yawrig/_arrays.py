"""Arrays, series and tables as numpy and pandas have them, as numbers: what is masked or missing is NaN."""

from __future__ import annotations

from typing import Any, List, Optional, Tuple

import numpy

from . import _native

Columns = List[Tuple[str, Optional[str], bytes]]


def is_table(given: Any) -> bool:
    """Whether it is a DataFrame."""
    return hasattr(given, "columns") and hasattr(given, "to_numpy")


def is_series(given: Any) -> bool:
    """Whether it is a Series: values with an index."""
    return not is_table(given) and hasattr(given, "to_numpy") and hasattr(given, "index") and not callable(given.index)


def numbers(values: Any, what: str = "values") -> numpy.ndarray:
    """Numbers in a row, of anything that numpy takes for them; times and durations of any unit in seconds, since the first."""
    array = _plain(values)
    if array.dtype.kind == "M":
        known = array[~numpy.isnat(array)]
        array = array - known[0] if len(known) else array - array
    if array.dtype.kind == "m":
        array = array / numpy.timedelta64(1, "s")
    mask = numpy.ma.getmaskarray(values) if isinstance(values, numpy.ma.MaskedArray) else None
    try:
        out = numpy.ascontiguousarray(array, dtype=numpy.float64)
    except (TypeError, ValueError) as error:
        raise _native.YawrigError(f"{what} are no numbers: {error}\n  help: give an array of numbers") from None
    if out.ndim != 1:
        raise _native.YawrigError(f"{what} has {out.ndim} dimensions\n  help: give numbers in a row, shape (n,)")
    if mask is not None and mask.any():
        out = numpy.where(mask, numpy.nan, out)
    return out


def _plain(values: Any) -> numpy.ndarray:
    """As numpy has it: a time zone taken off, what pandas calls missing NaN or NaT."""
    if getattr(getattr(values, "dtype", None), "tz", None) is not None:
        of = getattr(values, "dt", values)
        values = of.tz_convert("UTC")
        values = getattr(values, "dt", values).tz_localize(None)
    array = numpy.asarray(getattr(values, "data", values) if isinstance(values, numpy.ma.MaskedArray) else values)
    if array.dtype != object:
        return array
    if hasattr(values, "to_numpy"):
        try:
            return numpy.asarray(values.to_numpy(dtype=numpy.float64, na_value=numpy.nan))
        except (TypeError, ValueError):
            pass
    first = next((value for value in array.ravel() if value is not None), None)
    if hasattr(first, "timestamp"):
        return numpy.array([numpy.nan if value is None else value.timestamp() for value in array.ravel()])
    if hasattr(first, "total_seconds"):
        return numpy.array([numpy.nan if value is None else value.total_seconds() for value in array.ravel()])
    return array


def columns(given: Any) -> Columns:
    """The columns of a DataFrame or a Series, its index before them where it holds times: name, unit, bytes."""
    index = given.index if hasattr(given, "index") and not callable(given.index) else None
    found: Columns = []
    if index is not None and (getattr(index, "name", None) or type(index).__name__ != "RangeIndex"):
        found += _column(index.name if index.name is not None else "time_s", index)
    if is_series(given):
        found += _column("yaw_deg" if given.name is None else given.name, given)
    else:
        for name in given.columns:
            found += _column(name, given[name])
    return found


def _column(name: Any, values: Any) -> Columns:
    kind = getattr(getattr(values, "dtype", None), "kind", "")
    try:
        array = numbers(values, str(name))
    except _native.YawrigError:
        return []
    return [(str(name), "s" if kind in ("M", "m") else None, array.tobytes())]
