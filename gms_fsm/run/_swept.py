"""The result of a sweep: the outcomes of many runs, as tables and files."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import QUANTITIES, FloatArray
from gms_fsm.errors import OutputError, TraceFileError, cut, shown
from gms_fsm.foundation.arguments import checked_path, no_file, refusing, unknown
from gms_fsm.foundation.display import Log
from gms_fsm.foundation.extras import require
from gms_fsm.foundation.files import write_whole
from gms_fsm.lowering.log_columns import LOG_NUMBERS
from gms_fsm.systems.numbers import column_name
from gms_fsm.traces.coverage.total import Coverage
from gms_fsm.traces.files.archives import member, write_arrays
from gms_fsm.traces.files.unreadable import unreadable

if TYPE_CHECKING:
    import pandas
    import xarray

LOG = np.dtype(
    [
        ("run", "i8"),
        ("t", "f8"),
        ("element", "i8"),
        ("edge", "i8"),
        *((name, "f8") for name in LOG_NUMBERS),
    ]
)


@refusing()
@dataclass(frozen=True, eq=False)
class Sweep:
    """The results of many runs, one row per run, in the order of the parameters.

    Attributes
    ----------
    parameters : mapping of str to ndarray, shape (runs,) or (runs, n)
        The parameters that were varied; of signals their texts.
    outcome : ndarray of str, shape (runs,)
        ``"ok"``, or the name of the error that ended the run.
    message : ndarray of str, shape (runs,)
        The error's text, or empty.
    t, x, v, F : ndarray, shape (runs,)
        The final values: s, m, m/s, N. NaN for a run that could not start.
    z : ndarray, shape (runs, n), m
        Deflections at the end.
    states : ndarray of str, shape (runs, n)
        Active states at the end.
    transitions : numpy.recarray
        All firings: ``run, t, element, edge, z, v, s, F_before, F_after``; run and element count
        from 0, ``edge`` is an index into `edges`.
    edges : tuple of str
        Names of the chart's edges.
    times : ndarray, shape (rows,)
        With ``output="t_eval"`` the times of the rows, otherwise empty.
    rows : mapping of str to ndarray
        With ``output="t_eval"``: ``x, v, F`` of shape (runs, rows), ``z`` of shape (runs, rows, n);
        of a system also the values in `ends`, of shape (runs, rows).
    ends : mapping of str to ndarray, shape (runs,)
        Of a system: ``load.x`` and ``load.v`` for each body at the end, and the further states and
        sampled values by name.
    owners : ndarray of str, shape (n,)
        Of a system: for each element the name of its contact. With several contacts, elements
        count over all of them, ``x, v, F`` have one column per contact, and `edges` are named
        ``gear.touch``; `contact` returns the results of one.
    coverage : Coverage or None
        What the runs have tried of the charts: states and edges, and with ``coverage=True`` clauses
        too. Files do not keep it.
    """

    parameters: Mapping[str, FloatArray]
    outcome: NDArray[np.str_]
    message: NDArray[np.str_]
    t: FloatArray
    x: FloatArray
    v: FloatArray
    F: FloatArray
    z: FloatArray
    states: NDArray[np.str_]
    transitions: Any
    edges: tuple[str, ...]
    times: FloatArray
    rows: Mapping[str, FloatArray]
    ends: Mapping[str, FloatArray] = field(default_factory=dict)
    owners: NDArray[np.str_] = field(default_factory=lambda: np.empty(0, dtype=np.str_))
    coverage: Coverage | None = field(default=None, repr=False)

    def __len__(self) -> int:
        return int(self.t.size)

    def __repr__(self) -> str:
        bad = int((self.outcome != "ok").sum())
        return (
            f"<Sweep: {len(self)} runs over {', '.join(self.parameters)}; {bad} failed, "
            f"{len(self.transitions)} transitions>"
        )

    @property
    def transition_count(self) -> NDArray[np.int64]:
        """How often an edge fired in each run, shape (runs,)."""
        return np.bincount(self.transitions["run"], minlength=len(self))

    @property
    def contacts(self) -> tuple[str, ...]:
        """Names of the contacts of a system."""
        return tuple(dict.fromkeys(self.owners.tolist()))

    def contact(self, name: str) -> Sweep:
        """Return the results of one contact of a system.

        Parameters
        ----------
        name : str
            The contact's.

        Returns
        -------
        Sweep
            With its ``x, v, F, z, states`` and transitions only.

        Raises
        ------
        ParameterError
            If there is no such contact.
        """
        if name not in self.contacts:
            raise unknown("contact", name, self.contacts)
        if len(self.contacts) == 1:
            return self
        which, mine = self.contacts.index(name), np.flatnonzero(self.owners == name)
        edges = [k for k, edge in enumerate(self.edges) if edge.startswith(f"{name}.")]
        log = self.transitions[np.isin(self.transitions["element"], mine)].copy()
        log["element"] -= mine[0]
        log["edge"] = np.searchsorted(edges, log["edge"])
        rows = {
            key: values[..., mine] if key == "z" else values[..., which] if key in "xvF" else values
            for key, values in self.rows.items()
        }
        return replace(
            self,
            x=self.x[:, which],
            v=self.v[:, which],
            F=self.F[:, which],
            z=self.z[:, mine],
            states=self.states[:, mine],
            transitions=log,
            edges=tuple(self.edges[k].removeprefix(f"{name}.") for k in edges),
            rows=rows,
            owners=self.owners[mine],
            coverage=self.coverage and Coverage({name: self.coverage.contact(name)}),
        )

    def sequence(self, run: int) -> list[tuple[int, str]]:
        """Return the firings of a run in order, as element and edge.

        Parameters
        ----------
        run : int
            Counted from 0.

        Returns
        -------
        list of (int, str)
            Elements count from 0.
        """
        log = self.transitions[self.transitions["run"] == run]
        return [(int(i), self.edges[edge]) for i, edge in zip(log.element, log.edge, strict=True)]

    def _has(self, values: FloatArray) -> bool:
        """Return whether a quantity exists: a supervisor has no motion and no force."""
        started = np.isfinite(self.t)
        return not (self.contacts and started.any() and np.isnan(values[started]).all())

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per run, by column.

        Returns
        -------
        dict of str to ndarray, shape (runs,)
            Parameters, outcome, end of the run; columns for elements are numbered from 1. A
            parameter with the same name as a result is called ``parameter_<name>``. Of a system,
            those of a contact have its name, ``gear.F``, and what a supervisor does not have, its
            position, velocity and force, has no column.

        Examples
        --------
        >>> from gms_fsm import GMS, GMSParameters, Prescribed, sweep
        >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
        >>> result = sweep(model, Prescribed("0.2"), 1.0, {"F_s": [1.5]}, engine="machines")
        >>> list(result.columns())[:8]
        ['F_s', 'outcome', 'message', 't', 'x', 'v', 'F', 'z1']
        """
        results: dict[str, NDArray[Any]] = {
            "outcome": self.outcome,
            "message": self.message,
            "t": self.t,
        }
        results |= {_distinct(name, results): values for name, values in self.ends.items()}
        for name in self.contacts or ("",):
            part, lead = (self.contact(name), f"{name}.") if name else (self, "")
            ends = {each: getattr(part, each) for each in ("x", "v", "F", "z")}
            for each, values in ends.items():
                results |= _numbered(f"{lead}{each}", values) if self._has(values) else {}
            results |= _numbered(f"{lead}state", part.states)
        results |= {"transitions": self.transition_count}
        parameters = {
            _distinct(column, results): numbers
            for name, values in self.parameters.items()
            for column, numbers in _numbered(name, values).items()
        }
        return parameters | results

    def to_dataframe(self) -> pandas.DataFrame:
        """Return one row per run as a pandas DataFrame (extra ``pandas``).

        Returns
        -------
        DataFrame
            The same data as `columns`.
        """
        pandas = require("pandas", "pandas")
        return pandas.DataFrame(self.columns(), index=pandas.RangeIndex(len(self), name="run"))

    def to_xarray(self) -> xarray.Dataset:
        """Return the results as an xarray Dataset (extra ``sweep``).

        Returns
        -------
        Dataset
            Dimensions ``run``, ``element`` (from 1) and, with rows, ``time``; units as
            attributes, as far as they are the same for all.
        """
        xarray = require("xarray", "sweep")
        # Contacts of a system may turn, or not; a column has all of them.
        known = ("t",) if self.contacts else ("t", "x", "v", "F", "z")
        units = {name: QUANTITIES[name].unit for name in known}
        data: dict[str, Any] = {}
        shown = [name for name in ("x", "v", "F") if self._has(getattr(self, name))]
        for name in ("outcome", "message", "t", *shown):
            values = getattr(self, name)
            dimensions = ("run", "contact")[: values.ndim]
            data[f"{name}_end" if name in units else name] = (dimensions, values)
        data |= {f"end.{name}": ("run", values) for name, values in self.ends.items()}
        data |= {"z_end": (("run", "element"), self.z)} if self._has(self.z) else {}
        data["state_end"] = (("run", "element"), self.states)
        data["transitions"] = ("run", self.transition_count)
        for name, values in self.rows.items():
            if not self._has(values):
                continue
            last = "element" if name == "z" else "contact"
            data[name] = (("run", "time", last)[: values.ndim], values)
        coordinates: dict[str, Any] = {
            "run": np.arange(len(self)),
            "element": np.arange(1, self.z.shape[1] + 1),
        }
        if self.contacts:
            coordinates["owner"] = ("element", self.owners)
        if len(self.contacts) > 1:
            coordinates["contact"] = list(self.contacts)
        if self.times.size:
            coordinates["time"] = self.times
        taken = {*data, *coordinates}
        parameters = {
            _distinct(name, taken): (("run", "element")[: values.ndim], values)
            for name, values in self.parameters.items()
        }
        dataset = xarray.Dataset(parameters | data, coordinates)
        for name, variable in dataset.variables.items():
            if unit := units.get(str(name).removesuffix("_end")):
                variable.attrs["units"] = unit
        return dataset

    def save(self, path: str | Path) -> Path:
        """Write the sweep to ``.npz`` (everything) or ``.parquet`` (one row per run).

        With Parquet, the transitions go next to it into ``<name>.transitions.parquet``.

        Parameters
        ----------
        path : str or Path
            The destination.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        OutputError
            If the folder cannot be written or the suffix is not supported.
        """
        path = checked_path("path", path)
        if path.suffix == ".npz":
            from gms_fsm._version import __version__

            arrays: dict[str, Any] = {"format": np.array(_FORMAT), "program": __version__}
            arrays |= {f"parameter_{name}": values for name, values in self.parameters.items()}
            arrays |= {f"rows_{name}": values for name, values in self.rows.items()}
            arrays |= {name: getattr(self, name) for name in _SAVED}
            arrays |= {f"end_{name}": values for name, values in self.ends.items()}
            arrays |= {"owners": self.owners} if self.contacts else {}
            arrays |= {"transitions": np.asarray(self.transitions), "elements": self.z.shape[1]}
            arrays["edges"] = np.array(self.edges, dtype=np.str_)
            return write_whole(path, lambda file: write_arrays(file, arrays))
        if path.suffix == ".parquet":
            pandas = require("pandas", "sweep")
            require("pyarrow", "sweep")
            log = pandas.DataFrame(
                {name: self.transitions[name] for name in LOG.names or ()}
                | {"edge": np.array(self.edges, dtype=object)[self.transitions["edge"]]}
            )
            log_path = path.with_name(f"{path.stem}.transitions.parquet")
            write_whole(log_path, log.to_parquet)
            return write_whole(path, self.to_dataframe().to_parquet)
        raise OutputError(
            f"a sweep is saved as .npz or .parquet, not {path.suffix!r}", place=str(path)
        )

    @classmethod
    def load(cls, path: str | Path) -> Sweep:
        """Read a sweep written to ``.npz``.

        Parameters
        ----------
        path : str or Path
            The file.

        Returns
        -------
        Sweep
            With equal arrays.

        Raises
        ------
        TraceFileError
            If the file is missing, damaged, or not a sweep of this format; nothing in it is
            executed.
        """
        path = checked_path("path", path)
        try:
            # Opened here because np.load does not close a damaged file.
            with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
                return _read(file)
        except FileNotFoundError:
            raise no_file(path, TraceFileError) from None
        except Exception as error:  # numpy and zipfile raise many kinds for damaged files
            raise unreadable(path, "sweep", error, advice="run it again") from None


# --------------------------------------------------------------------------- files
_FORMAT = "gms-fsm sweep 1"
_SAVED = ("outcome", "message", "t", "x", "v", "F", "z", "states", "times")
LONGEST = 1000  # characters of a text


def _read(file: Any) -> Sweep:
    """Read an open archive, checking every array against the size of a sweep of so many runs."""
    stamp = str(member(file, "format"))
    if stamp != _FORMAT:
        program = cut(str(member(file, "program")))
        raise ValueError(f"format {shown(stamp)} of gms-fsm {program}, not {_FORMAT!r}")
    t, times, edges = (member(file, name) for name in ("t", "times", "edges"))
    runs, rows, n = t.size, times.size, int(member(file, "elements", 8))
    texts = {"outcome": (runs,), "message": (runs,), "states": (runs, n)}
    several: tuple[int, ...] = ()
    if "owners" in file.files:
        texts["owners"] = (n,)
        contacts = len(set(member(file, "owners", 4 * LONGEST * n).tolist()))
        several = (contacts,) if contacts > 1 else ()
    ends = [name for name in file.files if name.startswith("end_")]
    floats: dict[str, tuple[int, ...]] = dict.fromkeys(("x", "v", "F"), (runs, *several))
    floats |= {"z": (runs, n), **dict.fromkeys(ends, (runs,))}
    if rows:
        floats |= {f"rows_{name}": (runs, rows, *several) for name in ("x", "v", "F")}
        floats["rows_z"] = (runs, rows, n)
        floats |= {f"rows_{row_name(name.removeprefix('end_'))}": (runs, rows) for name in ends}
    own = [name for name in file.files if name.startswith("parameter_")]
    found = {name: member(file, name, runs * max(8 * n, 4 * LONGEST)) for name in own}
    for name, array in found.items():  # a contact has some of the elements of a system
        if array.dtype.kind == "U":
            texts[name] = (runs,)
            continue
        width = min(n, *array.shape[1:2]) if "owners" in texts and array.ndim > 1 else n
        floats[name] = (runs, width)[: array.ndim]
    for shapes, width in ((texts, 4 * LONGEST), (floats, 8)):
        for name in [name for name in shapes if name not in found]:
            found[name] = member(file, name, width * math.prod(shapes[name]))
    found |= {"t": t, "times": times, "edges": edges}
    floats |= {"t": (runs,), "times": (rows,)}
    texts["edges"] = (len(edges),)
    for name, array in found.items():
        shape, kind = (texts[name], "U") if name in texts else (floats[name], "f")
        if array.shape != shape or array.dtype.kind != kind:
            raise ValueError(f"{name} is {array.dtype} {array.shape}; a sweep has {kind} {shape}")
    log = member(file, "transitions")
    if log.ndim != 1 or log.dtype != LOG:
        raise ValueError("the columns of the transition log are not those of a sweep")
    for name, count in (("run", runs), ("element", n), ("edge", len(edges))):
        if log.size and not 0 <= log[name].min() <= log[name].max() < count:
            raise ValueError(f"the transition log: {name} must be within 0 to {count - 1}")
    if not (own and runs and n and (np.diff(log["run"]) >= 0).all()):
        raise ValueError("no runs, no parameters, or runs not in order")
    groups = {
        group: {name.removeprefix(group): found[name] for name in found if name.startswith(group)}
        for group in ("parameter_", "rows_", "end_")
    }
    return Sweep(
        parameters=groups["parameter_"],
        rows=groups["rows_"],
        ends=groups["end_"],
        owners=found.get("owners", np.empty(0, dtype=np.str_)),
        edges=tuple(edges.tolist()),
        transitions=log.view(Log),
        **{name: found[name] for name in _SAVED},
    )


def _numbered(name: str, values: NDArray[Any]) -> dict[str, Any]:
    """Return columns for a DataFrame: name, or name1, name2 ... for the elements."""
    if values.ndim == 1:
        return {name: values}
    return {column_name(name, i): values[:, i] for i in range(values.shape[1])}


def row_name(name: str) -> str:
    """Return the name of a system's value among the rows: other than those of a contact."""
    return f"system.{name}" if name in ("x", "v", "F", "z") else name


def _distinct(name: str, taken: Collection[str]) -> str:
    """Return a column name for a parameter that differs from those of the results."""
    return f"parameter_{name}" if name in taken else name
