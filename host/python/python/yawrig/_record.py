"""Records in memory."""

from __future__ import annotations

import json
import os
from typing import Any, Dict, List, Optional, Union

import numpy

from . import _arrays, _native


def as_bytes(values: Any, what: str = "values") -> bytes:
    """Numbers of eight bytes each, of anything that numpy takes for numbers in a row."""
    return _arrays.numbers(values, what).tobytes()


def as_array(numbers: bytes) -> numpy.ndarray:
    """The array of these bytes."""
    return numpy.frombuffer(numbers, dtype=numpy.float64)


def _selection(**asked: Any) -> str:
    return json.dumps({name: value for name, value in asked.items() if value is not None})


class Record:
    """A recorded release.

    Parameters
    ----------
    time_s : array of shape (n,)
        Seconds, increasing, from any origin; or datetime64 or timedelta64 of any unit.
    angle_deg : array of shape (n,)
        Angle in degrees as the sensor shows it, or what ``quantity`` and ``unit`` say. What is masked or NaN is a gap.
    name : str
        What messages and results call it.
    quantity : "angle", "rate", "acceleration" or "displacement"
    unit : str
        ``"rad"``, ``"deg/s"``, ``"mm"``: of an angle, its rate or acceleration it is converted to degrees.
    motion : "yaw", "pitch", "roll", "pendulum" or "displacement"
        What results and plots call it.

    >>> Record([0.0, 0.5], [3.14, 0.0], quantity="rate", unit="rad/s").unit
    'deg/s'
    """

    def __init__(
        self,
        time_s: Any,
        angle_deg: Any,
        name: str = "record",
        *,
        quantity: Optional[str] = None,
        unit: Optional[str] = None,
        motion: Optional[str] = None,
    ) -> None:
        said, scale = _native.said(_selection(quantity=quantity, unit=unit, motion=motion))
        time, angle = _arrays.numbers(time_s, "time_s"), _arrays.numbers(angle_deg, "angle_deg") * scale
        if len(time) != len(angle):
            raise _native.YawrigError(
                f"{name}: {len(time)} times and {len(angle)} angles\n  help: give an angle for each time"
            )
        known = ~(numpy.isnan(time) | numpy.isnan(angle))
        if not known.any():
            raise _native.YawrigError(f"{name}: all of its samples are masked or NaN\n  help: give those that were taken")
        self._given = (name, time[known].tobytes(), angle[known].tobytes(), (False, 0.0), said)

    @classmethod
    def of_table(
        cls,
        table: Any,
        name: str = "record",
        *,
        time: Optional[str] = None,
        yaw: Optional[str] = None,
        unit: Optional[str] = None,
        time_unit: Optional[str] = None,
        rate_hz: Optional[float] = None,
        quantity: Optional[str] = None,
        motion: Optional[str] = None,
    ) -> "Record":
        """The record in a DataFrame, or a Series with its times as the index: columns are found as in a file, see :func:`read`."""
        selection = _selection(
            time=time, yaw=yaw, unit=unit, time_unit=time_unit, rate_hz=rate_hz, quantity=quantity, motion=motion
        )
        return cls._of(_native.of_table(name, _arrays.columns(table), selection))

    @classmethod
    def _of(cls, given: _native.Given) -> "Record":
        record = cls.__new__(cls)
        record._given = given
        return record

    @property
    def name(self) -> str:
        """What messages and results call it."""
        return self._given[0]

    @property
    def time_s(self) -> numpy.ndarray:
        """Times in seconds, shape (n,)."""
        return as_array(self._given[1])

    @property
    def angle_deg(self) -> numpy.ndarray:
        """Angles in degrees, shape (n,)."""
        if self.quantity != "angle":
            raise _native.YawrigError(
                f"{self.name} is a record of {self.quantity} in {self.unit}, not of an angle\n  help: take its values"
            )
        return self.values

    @property
    def values(self) -> numpy.ndarray:
        """What was recorded, in ``unit``, shape (n,)."""
        return as_array(self._given[2])

    @property
    def quantity(self) -> str:
        """``"angle"``, ``"rate"``, ``"acceleration"`` or ``"displacement"``."""
        return self._said.get("quantity", "angle")

    @property
    def unit(self) -> str:
        """Of the values."""
        return self._said.get("unit", "deg")

    @property
    def _said(self) -> Dict[str, str]:
        said: Dict[str, str] = json.loads(self._given[4])
        return said

    def releases(self) -> List["Record"]:
        """The releases in it, each a record: ``name#1``, ``name#2``, ...; itself where it holds one."""
        parts = _native.releases(self._given)
        return [self] if len(parts) == 1 else [Record._of(part) for part in parts]

    def __len__(self) -> int:
        return len(self._given[1]) // 8

    def __repr__(self) -> str:
        return f"<yawrig.Record {self.name}: {len(self)} samples, {self.time_s[0]:.3f} to {self.time_s[-1]:.3f} s>"


def read(
    path: Union[str, "os.PathLike[str]"],
    *,
    time: Optional[str] = None,
    yaw: Optional[str] = None,
    unit: Optional[str] = None,
    time_unit: Optional[str] = None,
    rate_hz: Optional[float] = None,
    quantity: Optional[str] = None,
    motion: Optional[str] = None,
) -> Record:
    """Reads a record: text, a workbook, MATLAB, HDF5, TDMS or Parquet, whatever it is called.

    Parameters
    ----------
    path : path
        ``r.csv``, or ``r.csv#2`` for the second release in it.
    time, yaw : str
        Channels, by name or by number from 1, where their names do not say what they are.
    unit : str
        Of the numbers: ``"deg"``, ``"rad/s"``, ``"mm"``.
    time_unit : "s", "ms", "us", "ns", "min", "h", "d" or "samples"
        Of the time.
    rate_hz : float
        Samples a second, where there is no time.
    quantity, motion : str
        As of a :class:`Record`.
    """
    selection = _selection(
        time=time, yaw=yaw, unit=unit, time_unit=time_unit, rate_hz=rate_hz, quantity=quantity, motion=motion
    )
    return Record._of(_native.read(os.fspath(path), selection))
