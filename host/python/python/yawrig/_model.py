"""The model of a record, as a function."""

from __future__ import annotations

from typing import Any, Callable, List, NamedTuple, Tuple

import numpy

from . import _native
from ._record import as_array, as_bytes


class Curves(NamedTuple):
    """Means of a record over a fiftieth of a period each, and the model there; arrays of shape (n,)."""

    time_s: numpy.ndarray
    angle_deg: numpy.ndarray
    model_deg: numpy.ndarray


class Model:
    """The model of a record: ``model(time_s)`` is what it reads, ``model.rhs`` the right-hand side of its equation.

    Times are on the record's clock. A state is an array of shape (n,): angle in deg, angular rate in deg/s, and with hysteresis
    the deflection of what yields, in deg; of a displacement in its own unit, as ``state_units`` says.

    >>> import numpy, yawrig
    >>> t = numpy.arange(0.0, 20.0, 0.01)
    >>> model = yawrig.identify(t, 12.0 * numpy.exp(-0.06 * t) * numpy.cos(6.0 * t)).model
    >>> model.state_units
    ['deg', 'deg/s']
    >>> model.rhs(model.start_s, [0.0, 10.0]).round(2)
    array([10. , -1.2])
    """

    #: Of the record.
    name: str
    #: When the model begins, s.
    start_s: float
    #: The state then, shape (n,).
    initial_state: numpy.ndarray
    #: The unit of each number of a state.
    state_units: List[str]

    def __init__(self, given: _native.ModelGiven) -> None:
        self.name, self.start_s, state, self.state_units, functions = given
        self.initial_state = as_array(state)
        self._all_curves, self._readings, self._slopes, self._reads = functions

    def __call__(self, time_s: Any) -> numpy.ndarray:
        """What the model reads, in degrees, in any order; NaN before ``start_s``.

        Parameters
        ----------
        time_s : number or array of any shape
        """
        time = numpy.asarray(time_s, dtype=numpy.float64)
        flat_s = time.ravel()
        order = numpy.argsort(flat_s, kind="stable")
        angle = numpy.empty_like(flat_s)
        angle[order] = as_array(self._readings(as_bytes(flat_s[order])))
        return angle.reshape(time.shape)

    def rhs(self, time_s: Any, state: Any) -> numpy.ndarray:
        """How fast the state changes, per s: as :func:`scipy.integrate.solve_ivp` takes it, ``vectorized`` or not.

        Where dry friction or free play is in the model it has steps, over which an integrator errs with its step.

        Parameters
        ----------
        time_s : number, or array of shape (k,)
        state : array of shape (n,), or (n, k)

        Returns
        -------
        array of the state's shape

        Raises
        ------
        YawrigError
            Where a random moment is in the answer: how it moves on is no function of time and state.
        """
        found, shape = self._of_states(self._slopes, time_s, state)
        return found.reshape(-1, len(self.state_units)).T.reshape(shape)

    def reading(self, time_s: Any, state: Any) -> Any:
        """What the record would show of a state, in degrees: with the sensor's zero and what else is of the sensor.

        Parameters
        ----------
        time_s : number, or array of shape (k,)
        state : array of shape (n,), or (n, k)

        Returns
        -------
        number, or array of shape (k,)
        """
        found, shape = self._of_states(self._reads, time_s, state)
        return found.reshape(shape[1:])[()]

    def _of_states(
        self, function: Callable[[bytes, bytes], bytes], time_s: Any, state: Any
    ) -> Tuple[numpy.ndarray, Tuple[int, ...]]:
        states = numpy.asarray(state, dtype=numpy.float64)
        n = len(self.state_units)
        if states.ndim not in (1, 2) or states.shape[0] != n:
            raise _native.YawrigError(
                f"a state of shape {states.shape}\n  help: this model's has {n} numbers ({', '.join(self.state_units)}):"
                f" shape ({n},) or ({n}, k)"
            )
        times = numpy.broadcast_to(numpy.asarray(time_s, dtype=numpy.float64), states.shape[1:])
        return as_array(function(as_bytes(times.ravel()), as_bytes(states.T.ravel()))), states.shape

    @property
    def curves(self) -> Curves:
        """The record and its model: ``time_s``, ``angle_deg`` and ``model_deg``, shape (n,)."""
        return Curves(*map(as_array, self._all_curves()))

    @property
    def residual(self) -> numpy.ndarray:
        """Record less model in degrees at ``curves.time_s``, shape (n,)."""
        curves = self.curves
        return curves.angle_deg - curves.model_deg

    def __repr__(self) -> str:
        return f"<yawrig.Model of {self.name} from {self.start_s:.3f} s>"
