"""Natural frequency, damping, missing physics and aerodynamic derivatives of releases.

>>> import numpy, yawrig
>>> time_s = numpy.arange(0.0, 20.0, 0.002)
>>> angle_deg = 12.0 * numpy.exp(-0.06 * time_s) * numpy.cos(6.0 * time_s)
>>> found = yawrig.identify(time_s, angle_deg)
>>> round(found.natural_frequency_rad_s.value, 3), round(found.damping_ratio.value, 4)
(6.0, 0.01)

Angles are in degrees, times in seconds, natural frequencies in rad/s. A result has the names of the program's JSON as
attributes; a quantity is a number with ``.value`` and ``.u``, its standard uncertainty (k = 1). What a verb of the program calls
``--from-deg`` is ``from_deg=`` here. The numbers are those of the program, to the bit.
"""

from ._native import YawrigError, __version__
from ._model import Model
from ._quantity import Quantity
from ._record import Record, read
from ._results import (
    Comparison,
    Derivatives,
    Diagnosis,
    Identification,
    Result,
    Simulated,
)
from ._verbs import (
    Campaign,
    Effect,
    YawrigWarning,
    add,
    compare,
    diagnose,
    export,
    fit,
    history,
    identify,
    identify_each,
    law,
    plan,
    reject,
    remove,
    report,
    simulate,
    simulate_campaign,
)

__all__ = [
    "Campaign",
    "Comparison",
    "Derivatives",
    "Diagnosis",
    "Effect",
    "Identification",
    "Model",
    "Quantity",
    "Record",
    "Result",
    "Simulated",
    "YawrigError",
    "YawrigWarning",
    "__version__",
    "add",
    "compare",
    "diagnose",
    "export",
    "fit",
    "history",
    "identify",
    "identify_each",
    "law",
    "plan",
    "read",
    "reject",
    "remove",
    "report",
    "simulate",
    "simulate_campaign",
]
