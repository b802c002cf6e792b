"""What can be asked."""

from __future__ import annotations

import json
import os
import tempfile
import warnings
from pathlib import Path
from typing import Any, Callable, Dict, Iterable, List, Mapping, Optional, Sequence, Tuple, Union

from . import _arrays, _native
from ._record import Record, read
from ._results import Comparison, Derivatives, Diagnosis, Identification, Result, Simulated
from ._trace import expression

PathLike = Union[str, "os.PathLike[str]"]
#: Told how many are done, of how many.
Progress = Callable[[int, int], Any]


class YawrigWarning(UserWarning):
    """What the program warns of on stderr."""


class Effect:
    """An effect of your own: a moment over the inertia, rad/s2, written as an expression or as a function of arrays.

    Parameters
    ----------
    id : str
        A name without blanks.
    moment : str or callable
        Of yaw angle ``b`` (rad), yaw rate ``r`` (rad/s), time ``t`` (s), natural frequency ``wn`` and ``wind`` (m/s). Or
        ``moment(angle_rad, rate_rad_s, ...)`` with the parameters by name, and ``time_s``, ``natural_frequency_rad_s``
        and ``wind_m_s`` where it needs them: it is called here, once and again, to write down what it computes, and is that
        expression from then on. It has numpy's elementwise functions and no branches.
    parameters : dict
        By name ``{"unit": "rad/s2", "start": 0.05, "min": 0.0}``; ``min`` and ``max`` may be left out.
    title : str
        For tables; ``id`` where it is left out.
    states : dict
        What a moment that follows late follows with, one or two by name: ``{"rate": "(r - z) / T", "unit": "rad/s"}``.
        ``rate`` is how fast it changes, per s, an expression or a function of what the moment may hold and of the states;
        ``start`` its value at the release, the one in balance where it is left out. The moment takes states by name, too.

    >>> Effect("drag", "-d * r * abs(r)", {"d": {"unit": "1", "start": 0.01, "min": 0.0}})
    <yawrig.Effect drag: -d * r * abs(r)>
    >>> def drag(angle_rad, rate_rad_s, d):
    ...     return -d * rate_rad_s * abs(rate_rad_s)
    >>> Effect("drag", drag, {"d": {"unit": "1", "start": 0.01, "min": 0.0}})
    <yawrig.Effect drag: -d * r * abs(r)>
    >>> parameters = {"c": {"unit": "1/s", "start": 0.5, "min": 0.0}, "T": {"unit": "s", "start": 0.1, "min": 0.001}}
    >>> def wake(angle_rad, rate_rad_s, z, c):
    ...     return -c * z
    >>> def follows(angle_rad, rate_rad_s, z, T):
    ...     return (rate_rad_s - z) / T
    >>> late = Effect("wake", wake, parameters, states={"z": {"unit": "rad/s", "rate": follows}})
    >>> late, late.states["z"]["rate"]
    (<yawrig.Effect wake: -c * z>, '(r - z) / T')
    """

    #: The expression.
    moment: str
    #: Unit, rate and start of each state, as expressions.
    states: Dict[str, Dict[str, Any]]

    def __init__(
        self,
        id: str,
        moment: Union[str, Callable[..., Any]],
        parameters: Mapping[str, Mapping[str, Any]],
        title: Optional[str] = None,
        states: Optional[Mapping[str, Mapping[str, Any]]] = None,
    ) -> None:
        self.id, self.parameters, self.title = id, parameters, title or id
        names = [*(states or {}), *parameters]

        def written(given: Any) -> Any:
            return expression(given, names, id) if callable(given) else given

        self.moment = written(moment)
        self.states = {
            name: {key: written(value) for key, value in state.items()} for name, state in (states or {}).items()
        }

    def to_toml(self) -> str:
        """The file that ``yawrig --effect`` takes."""
        # JSON's strings and numbers are TOML's, too.
        lines = [f"{name} = {json.dumps(getattr(self, name))}" for name in ["id", "title", "moment"]]
        for name, state in self.states.items():
            lines += ["[[state]]", f"name = {json.dumps(name)}"]
            lines += [f"{key} = {json.dumps(value)}" for key, value in state.items()]
        lines.append("[parameters]")
        for name, parameter in self.parameters.items():
            inside = ", ".join(f"{key} = {json.dumps(value)}" for key, value in parameter.items())
            lines.append(f"{name} = {{ {inside} }}")
        return "\n".join(lines) + "\n"

    def __repr__(self) -> str:
        return f"<yawrig.Effect {self.id}: {self.moment}>"


EffectLike = Union[str, "os.PathLike[str]", Effect]
RecordLike = Union[Record, PathLike, Tuple[Any, Any], Any]


def _record(given: Any, name: str) -> Record:
    if isinstance(given, Record):
        return given
    if isinstance(given, (str, os.PathLike)):
        return read(given)
    if _arrays.is_table(given) or _arrays.is_series(given):
        return Record.of_table(given, name)
    time_s, angle_deg = given
    return Record(time_s, angle_deg, name)


def _is_one(given: Any) -> bool:
    """Whether it is one record and not several: two arrays of numbers are a record's times and angles."""
    if isinstance(given, (Record, str, os.PathLike)) or _arrays.is_table(given) or _arrays.is_series(given):
        return True
    return isinstance(given, tuple) and len(given) == 2 and not any(
        isinstance(part, (Record, str, os.PathLike, tuple)) for part in given
    )


def _records(given: Any, angle_deg: Any, name: str) -> List[Record]:
    if angle_deg is not None:
        return [Record(given, angle_deg, name)]
    if _is_one(given):
        return [_record(given, name)]
    return [_record(one, f"{name} {k + 1}") for k, one in enumerate(given)]


def _flags(**options: Any) -> List[str]:
    """As on the command line."""
    out: List[str] = []
    for name, value in options.items():
        flag = "--" + name.replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            out.append(flag)
        elif isinstance(value, (list, tuple)):
            out.extend(f"{flag}={one}" for one in value)
        elif isinstance(value, str):
            out.append(f"{flag}={value}")
        else:
            number = float(value)
            out.append(f"{flag}={int(number)}" if number.is_integer() and abs(number) < 1e15 else f"{flag}={number!r}")
    return out


def _ask(verb: str, arguments: List[str], records: Sequence[Record] = (), progress: Optional[Progress] = None) -> Any:
    answer = _native.ask(verb, arguments, [record._given for record in records], progress)
    for text in answer[-1]:
        if text.startswith("yawrig: warning: "):
            warnings.warn(text[len("yawrig: warning: ") :], YawrigWarning, stacklevel=3)
    return answer


class _Effects:
    """Effects as the program takes them: files of own ones lie in a folder that is gone afterwards."""

    def __init__(self, effects: Optional[Iterable[EffectLike]]) -> None:
        self._effects = list(effects or [])
        self._folder = tempfile.TemporaryDirectory(prefix="yawrig-") if self._has_own() else None

    def _has_own(self) -> bool:
        return any(isinstance(effect, Effect) for effect in self._effects)

    def __enter__(self) -> List[str]:
        return [self._named(effect) for effect in self._effects]

    def _named(self, effect: EffectLike) -> str:
        if not isinstance(effect, Effect):
            return os.fspath(effect)
        assert self._folder is not None
        file = Path(self._folder.name) / f"{effect.id}.toml"
        file.write_text(effect.to_toml(), encoding="utf-8")
        return str(file)

    def __exit__(self, *_: Any) -> None:
        if self._folder is not None:
            self._folder.cleanup()


def _names(records: Sequence[Record]) -> List[str]:
    return ["--", *(record.name for record in records)]


def identify(
    time_s: Any,
    angle_deg: Any = None,
    *,
    name: str = "record",
    method: str = "least-squares",
    from_deg: Optional[float] = None,
    to_deg: Optional[float] = None,
    spectral_peak: Optional[str] = None,
    decay: Optional[str] = None,
) -> Identification:
    """Natural frequency and damping ratio of a release, with their uncertainties.

    Parameters
    ----------
    time_s : array of shape (n,), or a Record, a path, a DataFrame, or a Series with its times as the index
        Times in seconds, or datetime64 or timedelta64. Release, hold, end and offset are found in the record.
    angle_deg : array of shape (n,)
        Angles in degrees.
    method : "least-squares", "conventional", "network" or "all"
    from_deg, to_deg : float
        Amplitudes in degrees between which it is analysed (10 and 1).

    >>> import numpy
    >>> t = numpy.arange(0.0, 20.0, 0.002)
    >>> identify(t, 12.0 * numpy.exp(-0.06 * t) * numpy.cos(6.0 * t)).window.from_deg > 9
    True
    """
    records = _records(time_s, angle_deg, name)
    if len(records) != 1:
        raise _native.YawrigError(f"{len(records)} records\n  help: identify_each takes several")
    options = _flags(method=method, from_deg=from_deg, to_deg=to_deg, spectral_peak=spectral_peak, decay=decay)
    return Identification(_ask("identify", options + _names(records), records))


def identify_each(
    records: Iterable[RecordLike],
    *,
    method: str = "least-squares",
    from_deg: Optional[float] = None,
    to_deg: Optional[float] = None,
    progress: Optional[Progress] = None,
) -> Identification:
    """Many records, on all cores: ``.records`` has one entry for each, ``.refused`` those that cannot be used, and why.

    ``progress`` is told how many are done, of how many: ``lambda done, of: bar.update(done - bar.n)`` with tqdm.
    """
    several = _records(list(records), None, "record")
    options = _flags(method=method, from_deg=from_deg, to_deg=to_deg)
    return Identification(_ask("identify", options + _names(several), several, progress))


def diagnose(
    records: Any,
    angle_deg: Any = None,
    *,
    name: str = "record",
    effects: Optional[Iterable[EffectLike]] = None,
    model: Optional[PathLike] = None,
    unknown_zero: bool = False,
    same_rig: bool = False,
    own: Sequence[str] = (),
    inertia_kg_m2: Optional[float] = None,
    gm_m: Optional[float] = None,
    displacement_kg: Optional[float] = None,
) -> Diagnosis:
    """Which physical effect a second-order model of a release lacks, or of several releases of one rig.

    Parameters
    ----------
    records : Record, path, pair of arrays, a list of them, or times in seconds
    angle_deg : array of shape (n,)
        Angles in degrees, where the first argument is times.
    effects : effects of your own that compete
    model : path
        A model whose effects stay.
    unknown_zero : bool
        The sensor was not zeroed.
    same_rig : bool
        Several records: one natural frequency and damping ratio for all.
    own : ids of effects
        Several records: a coefficient for each.
    inertia_kg_m2, or gm_m and displacement_kg : float
        Of a ship whose records say ``motion="roll"``: ``.roll`` has its coefficients and equivalent linear damping.
    """
    several = _records(records, angle_deg, name)
    with _Effects(effects) as named:
        options = _flags(
            effect=named, model=None if model is None else os.fspath(model), unknown_zero=unknown_zero,
            same_rig=same_rig, own=list(own),
            inertia_kg_m2=inertia_kg_m2, gm_m=gm_m, displacement_kg=displacement_kg,
        )
        return Diagnosis(_ask("diagnose", options + _names(several), several))


def compare(
    records: Any,
    angle_deg: Any = None,
    *,
    effects: Optional[Iterable[EffectLike]] = None,
    name: str = "record",
    model: Optional[PathLike] = None,
    unknown_zero: bool = False,
) -> Comparison:
    """A second-order model, or the one in the file ``model``, with effects on top, fitted to records, and where it fails.

    Parameters
    ----------
    records : Record, path, pair of arrays, a list of them, or times in seconds
    angle_deg : array of shape (n,)
        Angles in degrees, where the first argument is times.
    effects : list
        Ids of the library, paths of files, or :class:`Effect`.
    """
    several = _records(records, angle_deg, name)
    with _Effects(effects) as named:
        options = _flags(
            effect=named, model=None if model is None else os.fspath(model), unknown_zero=unknown_zero
        )
        return Comparison(_ask("compare", options + _names(several), several))


def law(
    records: Any,
    angle_deg: Any = None,
    *,
    name: str = "record",
    may_drive: bool = False,
    inertia_kg_m2: Optional[float] = None,
    gm_m: Optional[float] = None,
    displacement_kg: Optional[float] = None,
) -> Result:
    """The law that a record shows beside the second-order response, measured and named: ``stiffness`` over yaw angle,
    ``damping`` over yaw rate, ``names`` of formulas, best first. Of a ship as :func:`diagnose`.
    """
    several = _records(records, angle_deg, name)
    options = _flags(may_drive=may_drive, inertia_kg_m2=inertia_kg_m2, gm_m=gm_m, displacement_kg=displacement_kg)
    return Result(_ask("law", options + _names(several), several))


def simulate(
    *,
    natural_frequency_rad_s: Optional[float] = None,
    damping_ratio: Optional[float] = None,
    spring: Optional[str] = None,
    wind_m_s: Optional[float] = None,
    axis: Optional[str] = None,
    effects: Sequence[str] = (),
    name: str = "simulated",
    amplitude_deg: Optional[float] = None,
    noise_deg: Optional[float] = None,
    noise_correlation: Optional[float] = None,
    offset_deg: Optional[float] = None,
    adc_step_deg: Optional[float] = None,
    rate_hz: Optional[float] = None,
    hold_s: Optional[float] = None,
    seconds: Optional[float] = None,
    seed: Optional[int] = None,
) -> Simulated:
    """A record of the virtual rig, in memory, whose truth is known: ``.record`` and ``.truth``.

    Parameters
    ----------
    natural_frequency_rad_s, damping_ratio : float
        What is planted; or
    spring : "K1" to "K8", with ``wind_m_s`` and ``axis`` ("mid" or "front")
    effects : list
        ``"coulomb_friction:c=0.1"``, as ``yawrig simulate --help`` lists them.

    >>> simulate(natural_frequency_rad_s=7.0, damping_ratio=0.01).truth.damping_ratio
    0.01
    """
    options = _flags(
        natural_frequency=natural_frequency_rad_s, damping=damping_ratio, spring=spring, wind=wind_m_s, axis=axis,
        effect=list(effects), out=name, amplitude_deg=amplitude_deg, noise_deg=noise_deg,
        noise_correlation=noise_correlation, offset_deg=offset_deg, adc_step_deg=adc_step_deg, rate_hz=rate_hz,
        hold_s=hold_s, seconds=seconds, seed=seed,
    )
    return Simulated(_ask("simulate", options))


def simulate_campaign(
    folder: PathLike,
    *,
    wind_m_s: Optional[float] = None,
    repeats: Optional[int] = None,
    effects: Sequence[str] = (),
    aerodynamic: bool = False,
    noise_deg: Optional[float] = None,
    rate_hz: Optional[float] = None,
    seed: Optional[int] = None,
    force: bool = False,
) -> "Campaign":
    """Writes a campaign of the virtual rig into ``folder``: 32 records and ``campaign.toml``."""
    options = _flags(
        campaign=os.fspath(folder), wind=wind_m_s, repeats=repeats, effect=list(effects), aerodynamic=aerodynamic,
        noise_deg=noise_deg, rate_hz=rate_hz, seed=seed, force=force,
    )
    made = Simulated(_ask("simulate", options))
    return Campaign(made.campaign, made)


def fit(
    model: PathLike,
    records: Sequence[PathLike] = (),
    *,
    hold_out: Sequence[PathLike] = (),
    unknown_zero: bool = False,
) -> Result:
    """Makes the model file ``model`` of records, or fits the one that is there again; its journal lies beside it."""
    options = _flags(model=os.fspath(model), hold_out=[os.fspath(r) for r in hold_out], unknown_zero=unknown_zero)
    return Result(_ask("fit", [*options, "--", *(os.fspath(record) for record in records)]))


def _reason(model: PathLike, why: Optional[str]) -> List[str]:
    return _flags(model=os.fspath(model), why=why)


def add(
    model: PathLike,
    effect: EffectLike,
    *,
    source: Optional[str] = None,
    may_drive: bool = False,
    keep: bool = False,
    why: Optional[str] = None,
) -> Result:
    """Adds an effect to the model file ``model`` and fits it; a step of its journal.

    Parameters
    ----------
    effect : str, path or Effect
        One of the library by its id, a file, one of your own, or ``"measured_law"``.
    source : "mechanical", "aerodynamic" or "each_wind"
        Of a campaign's model: where its strength comes from; what predicts best where it is left out.
    may_drive : bool
        ``"measured_law"``: its damping may put energy in.
    keep : bool
        Keep it though with it what was held out is predicted worse, which is an error with ``exit_code`` 6 else.
    why : str
        The reason, for the journal.

    ``.before`` and ``.residual_over_noise``, ``.held_out_over_noise`` tell whether the error fell.
    """
    if source not in (None, "mechanical", "aerodynamic", "each_wind"):
        raise _native.YawrigError(
            f"source={source!r}\n  help: give 'mechanical', 'aerodynamic' or 'each_wind', or leave it out"
        )
    sources = {source: True} if source else {}
    with _Effects([effect]) as named:
        options = [*_reason(model, why), *_flags(may_drive=may_drive, keep=keep, **sources)]
        return Result(_ask("add", [*options, "--", *named]))


def remove(model: PathLike, effect: str, *, why: Optional[str] = None) -> Result:
    """Takes an effect out of the model file ``model`` and fits what is left; a step of its journal."""
    return Result(_ask("remove", [*_reason(model, why), "--", effect]))


def reject(model: PathLike, effect: EffectLike, why: str) -> Result:
    """Writes down, with the reason, that an effect is not to be added; the model stays as it is."""
    with _Effects([effect]) as named:
        return Result(_ask("reject", [*_reason(model, why), "--", *named]))


def history(model: PathLike, *, return_to: Optional[int] = None, why: Optional[str] = None) -> Result:
    """The steps of a model's journal, ``.steps``; before that, a return to the one with the number ``return_to``."""
    back = [] if return_to is None else [f"--return={return_to}"]
    return Result(_ask("history", [*_reason(model, why), *back]))


def export(model: PathLike, out: PathLike, *, to: str, force: bool = False) -> str:
    """Writes a model to the file ``out`` for use elsewhere, ``to`` "python", "matlab", "c" or "csv"; its path."""
    options = _flags(to=to, out=os.fspath(out), force=force)
    return str(Result(_ask("export", [*options, "--", os.fspath(model)])).out)


def report(
    files: Union[PathLike, Sequence[PathLike]],
    out: PathLike = "report.html",
    *,
    xlsx: Optional[PathLike] = None,
    pictures: Optional[PathLike] = None,
    unknown_zero: bool = False,
    force: bool = False,
) -> Result:
    """Writes what is known of records, a campaign, a model or a demo to one page that needs no network.

    Parameters
    ----------
    files : path or list of paths
        Records, one campaign.toml, one or more models, or the folder of a demo.
    out, xlsx : path
        The page, and a workbook of all its tables.
    pictures : path
        A folder for its drawings, an SVG each.
    force : bool
        Write over what is there.

    The result is the data in the page.
    """
    one = isinstance(files, (str, os.PathLike))
    several = [files] if one else list(files)  # type: ignore[list-item, arg-type]
    options = _flags(
        out=os.fspath(out), xlsx=None if xlsx is None else os.fspath(xlsx),
        pictures=None if pictures is None else os.fspath(pictures), unknown_zero=unknown_zero, force=force,
    )
    return Result(_ask("report", [*options, "--", *(os.fspath(file) for file in several)]))


def plan(
    file: PathLike,
    *,
    rivals: Sequence[str] = (),
    derivative: Optional[str] = None,
    progress: Optional[Progress] = None,
) -> Result:
    """Which release next: ``releases``, best first, would tell rival models of a model file or a campaign apart."""
    options = _flags(rival=list(rivals), derivative=derivative)
    return Result(_ask("plan", [*options, "--", os.fspath(file)], progress=progress))


class Campaign:
    """A campaign: the file that says under what each of its records was made."""

    def __init__(self, path: PathLike, simulated: Optional[Simulated] = None) -> None:
        #: Where its file is.
        self.path = os.fspath(path)
        #: What was planted, where it was simulated.
        self.simulated = simulated

    @classmethod
    def from_toml(cls, path: PathLike) -> "Campaign":
        """The campaign in the file at ``path``; it is read where something is computed of it."""
        return cls(path)

    def derivatives(
        self,
        *,
        method: str = "least-squares",
        from_deg: Optional[float] = None,
        to_deg: Optional[float] = None,
        progress: Optional[Progress] = None,
    ) -> Derivatives:
        """The aerodynamic derivatives, per radian, with uncertainties, budget and validation."""
        options = _flags(method=method, from_deg=from_deg, to_deg=to_deg)
        return Derivatives(_ask("derivatives", [*options, "--", self.path], progress=progress))

    def diagnose(self, *, effects: Optional[Iterable[EffectLike]] = None, unknown_zero: bool = False) -> Diagnosis:
        """Which effects its releases need, and whether they are mechanical or aerodynamic."""
        with _Effects(effects) as named:
            options = _flags(effect=named, unknown_zero=unknown_zero)
            return Diagnosis(_ask("diagnose", [*options, "--", self.path]))

    def plan(self, *, rivals: Sequence[str] = (), derivative: Optional[str] = None,
             progress: Optional[Progress] = None) -> Result:
        """As :func:`plan`."""
        return plan(self.path, rivals=rivals, derivative=derivative, progress=progress)

    def __repr__(self) -> str:
        return f"<yawrig.Campaign {self.path}>"
