"""Results: the JSON of the program with attributes, tables and pictures."""

from __future__ import annotations

import html
import json
from functools import cached_property
from typing import Any, Dict, Iterator, List, Optional

import numpy

from . import _native
from ._model import Curves, Model
from ._quantity import Quantity
from ._record import Record


class Fields:
    """A part of a result: its fields are attributes, and items, too."""

    def __init__(self, fields: Dict[str, Any]) -> None:
        self._fields = fields

    def _lookup(self, name: str) -> Any:
        return self._fields[name]

    def _names(self) -> Iterator[str]:
        return iter(self._fields)

    def __getattr__(self, name: str) -> Any:
        # Before there are any: copies and pickles ask for their own methods first.
        if not name.startswith("_"):
            try:
                return wrapped(self._lookup(name))
            except KeyError:
                pass
        raise AttributeError(f"{type(self).__name__} has no {name}; it has {', '.join(sorted(set(dir(self))))}")

    def __getitem__(self, name: str) -> Any:
        return wrapped(self._lookup(name))

    def __contains__(self, name: str) -> bool:
        return name in self._names()

    def __iter__(self) -> Iterator[str]:
        return self._names()

    def __len__(self) -> int:
        return len(list(self._names()))

    def __dir__(self) -> List[str]:
        own = [name for name in super().__dir__() if not name.startswith("_")]
        return own + [name for name in self._names() if name.isidentifier()]

    def to_dict(self) -> Dict[str, Any]:
        """As plain dicts, lists and numbers."""
        return json.loads(json.dumps(self._fields))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{n}={self[n]!r}' for n in self._names())})"


def wrapped(value: Any) -> Any:
    """A part of the JSON as a result shows it."""
    if isinstance(value, dict):
        return Quantity(value["value"], value["u"]) if value.keys() == {"value", "u"} else Fields(value)
    return [wrapped(item) for item in value] if isinstance(value, list) else value


def flat(row: Dict[str, Any], before: str = "") -> Dict[str, Any]:
    """A row of a table: a quantity has two columns, ``name`` and ``name_u``; what is no number or word is left out."""
    out: Dict[str, Any] = {}
    for name, value in row.items():
        if isinstance(value, dict) and value.keys() == {"value", "u"}:
            out[before + name], out[f"{before}{name}_u"] = value["value"], value["u"]
        elif isinstance(value, dict):
            out.update(flat(value, f"{before}{name}."))
        elif not isinstance(value, list):
            out[before + name] = value
    return out


class Result(Fields):
    """An answer. Its attributes have the names of the program's JSON, which is ``to_dict()``; as items, too."""

    #: The verdict in a sentence.
    sentence: str

    def __init__(self, answered: _native.Answered) -> None:
        self._json, self.sentence, rest, _ = answered
        self._made, self._all_models, self._drawn = rest
        super().__init__(json.loads(self._json))

    def __reduce__(self) -> Any:
        # What is drawn and simulated stays where it was made.
        return restored, (type(self), self._json, self.sentence)

    def to_dict(self) -> Dict[str, Any]:
        """The JSON that ``yawrig VERB --json`` prints."""
        return json.loads(self._json)

    def rows(self) -> List[Dict[str, Any]]:
        """The result's table: a dict for each row."""
        return [flat(self._fields)]

    def to_dataframe(self) -> Any:
        """The result's table as a pandas DataFrame, units in the columns' names."""
        import pandas

        return pandas.DataFrame(self.rows())

    @cached_property
    def models(self) -> List[Model]:
        """The model of each record, in the order of the records; empty where the answer is none of a model."""
        return [Model(given) for given in self._all_models()]

    @property
    def model(self) -> Model:
        """The model of the record: ``model(time_s)``, ``model.rhs(time_s, state)``; of several records see ``models``."""
        models = self.models
        if len(models) != 1:
            what = f"models of {len(models)} records, not of one" if models else "no model of a record"
            help = "\n  help: .models has one for each" if models else ""
            raise _native.YawrigError(f"this result has {what}{help}")
        return models[0]

    @property
    def curves(self) -> Curves:
        """``model.curves``."""
        return self.model.curves

    @property
    def residual(self) -> numpy.ndarray:
        """``model.residual``: record less model in degrees at ``curves.time_s``, shape (n,)."""
        return self.model.residual

    @property
    def covariance(self) -> Optional[numpy.ndarray]:
        """Covariance of the model's numbers, shape (m, m), in the order of ``covariance_names``; None where there is none."""
        found = self._found("covariance")
        return None if found is None else numpy.array(found["matrix"], dtype=numpy.float64)

    @property
    def covariance_names(self) -> List[str]:
        """What the rows and columns of ``covariance`` are of."""
        found = self._found("covariance")
        return [] if found is None else list(found["names"])

    def _found(self, name: str) -> Any:
        try:
            return self._lookup(name)
        except KeyError:
            return None

    @property
    def pictures(self) -> List[str]:
        """The pictures of a report's page, each an SVG."""
        return [svg for svg, _ in self._drawn()]

    def plot(self) -> Any:
        """Record, model and residual with matplotlib; returns the figure."""
        from matplotlib import pyplot

        curves = self.curves
        figure, (above, below) = pyplot.subplots(2, 1, sharex=True, layout="constrained")
        above.plot(curves.time_s, curves.angle_deg, label="record")
        above.plot(curves.time_s, curves.model_deg, label="model", linewidth=0.8)
        above.set(ylabel="angle (deg)", title=self.sentence)
        above.legend()
        below.plot(curves.time_s, curves.angle_deg - curves.model_deg, linewidth=0.8)
        below.set(ylabel="record less model (deg)", xlabel="time (s)")
        return figure

    def __repr__(self) -> str:
        return f"<yawrig.{type(self).__name__}: {self.sentence}>"

    def _repr_html_(self) -> str:
        rows = self.rows()
        names = list(dict.fromkeys(name for row in rows for name in row))
        cell = lambda value: html.escape(f"{value:.6g}" if isinstance(value, float) else "" if value is None else str(value))
        head = "".join(f"<th>{html.escape(name)}</th>" for name in names)
        body = "".join(f"<tr>{''.join(f'<td>{cell(row.get(n))}</td>' for n in names)}</tr>" for row in rows)
        shown = "".join(
            f"<figure>{svg}<figcaption>{html.escape(caption)}</figcaption></figure>"
            for svg, caption in self._drawn()
        )
        return f"<p><b>{html.escape(self.sentence)}</b></p><table><tr>{head}</tr>{body}</table>{shown}"


def _elsewhere(*_: Any) -> Any:
    raise _native.YawrigError("a copied result has no model and no pictures: they stay where it was made")


def restored(cls: type, text: str, sentence: str) -> Result:
    """A result from what travels of it."""
    return cls((text, sentence, (_elsewhere, _elsewhere, lambda: []), []))


class Identification(Result):
    """What :func:`identify` found. Beside the JSON's names those of the record and of its first estimate are attributes."""

    natural_frequency_rad_s: Quantity
    damping_ratio: Quantity
    natural_frequency_range_rad_s: List[float]
    damping_ratio_range: List[float]
    at_amplitude: List[Any]

    def _lookup(self, name: str) -> Any:
        for fields in self._layers():
            if name in fields:
                return fields[name]
        raise KeyError(name)

    def _layers(self) -> List[Dict[str, Any]]:
        records = self._fields["records"]
        return [self._fields] + ([records[0], records[0]["estimates"][0]] if len(records) == 1 else [])

    def _names(self) -> Iterator[str]:
        return iter(dict.fromkeys(name for fields in self._layers() for name in fields))

    def rows(self) -> List[Dict[str, Any]]:
        """A row for each record and method."""
        return [
            {**flat({k: v for k, v in record.items() if k != "estimates"}), **flat(estimate)}
            for record in self._fields["records"]
            for estimate in record["estimates"]
        ]


class Judged(Result):
    """What a result of :func:`diagnose` and one of :func:`compare` have in common."""

    effects: List[str]
    natural_frequency_rad_s: Quantity
    damping_ratio: Quantity

    def _lookup(self, name: str) -> Any:
        if name in self._fields:
            return self._fields[name]
        return (self._fields.get("modal") or {})[name]

    def _names(self) -> Iterator[str]:
        return iter(dict.fromkeys([*self._fields, *(self._fields.get("modal") or {})]))


class Diagnosis(Judged):
    """What :func:`diagnose` found: ``status``, ``effects``, ``steps``, ``candidates`` and more."""

    status: str

    @property
    def parameters(self) -> Fields:
        """Numbers of the effects by ``effect.name``, each a quantity."""
        steps = self._fields["steps"]
        return Fields((steps[-1].get("parameters") or {}) if steps else {})

    def rows(self) -> List[Dict[str, Any]]:
        """A row for each model that was gone through, the last being the answer."""
        return [flat(step) for step in self._fields["steps"]]


class Comparison(Judged):
    """What :func:`compare` found."""

    def rows(self) -> List[Dict[str, Any]]:
        """A row for each record."""
        return [flat({**self._fields["modal"], **record}) for record in self._fields["records"]]


class Derivatives(Result):
    """The table of a campaign; ``points`` has the derivatives per radian."""

    def rows(self) -> List[Dict[str, Any]]:
        """A row for each point."""
        return [flat({k: v for k, v in point.items() if k != "budget"}) for point in self._fields["points"]]

    def plot(self) -> Any:
        """The derivatives over the reduced frequency with bars of k = 2, with matplotlib; returns the figure."""
        from matplotlib import pyplot

        figure, axes = pyplot.subplots(2, 2, sharex=True, layout="constrained")
        for axis, name in zip(axes.flat, ["cn_beta", "cn_r", "cy_beta", "cy_r"]):
            points = [p for p in self._fields["points"] if p[name] is not None]
            at = [p["reduced_frequency"] for p in points]
            axis.errorbar(at, [p[name]["value"] for p in points], [2 * p[name]["u"] for p in points], fmt="o")
            axis.set(title=f"{name} per rad", xlabel="reduced frequency")
        return figure


class Simulated(Result):
    """A record of the virtual rig with its truth."""

    @property
    def record(self) -> Record:
        """The record."""
        given = self._made()
        if given is None:
            raise _native.YawrigError("a campaign was written, not a record made")
        return Record._of(given)

    def plot(self) -> Any:
        """The record with matplotlib; returns the figure."""
        from matplotlib import pyplot

        figure, axis = pyplot.subplots(layout="constrained")
        axis.plot(self.record.time_s, self.record.values)
        axis.set(xlabel="time (s)", ylabel=f"{self.record.quantity} ({self.record.unit})", title=self.sentence)
        return figure
