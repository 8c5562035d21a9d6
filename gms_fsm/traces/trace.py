"""A finished run: rows, micro-steps, the transition log, the model and the rig.

m firings at one time give m + 1 rows: micro-step 0 before the firings, then one row after each.
Where a slide along a surface begins or ends there is one more row, with the micro-step of the row
before it. With requested times (`t_eval`) the rows are exactly at those times, right-continuous;
the log is always complete.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import checked_integer, checked_path, pointing, refusing, unknown
from gms_fsm.foundation.display import asked, displayed
from gms_fsm.foundation.extras import require
from gms_fsm.foundation.text import visible
from gms_fsm.gradients.sensitivities import Sensitivities
from gms_fsm.lowering.layout import BankPlaces
from gms_fsm.lowering.program import Program, lower
from gms_fsm.lowering.scales import Setting
from gms_fsm.systems.models import Model
from gms_fsm.systems.mounted import Mounted
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.system import System
from gms_fsm.traces.files.columns import columns_of
from gms_fsm.traces.firings import Firings
from gms_fsm.traces.impulses import impulses_of
from gms_fsm.traces.observed import Observed
from gms_fsm.traces.rows import Rows, merged
from gms_fsm.traces.verdicts import Trust, Verdict
from gms_fsm.traces.views import (
    CALLED,
    BodyTrace,
    contact_seen,
    driven_velocity,
    dwell_times,
    given_values,
    read_parts,
    sampled,
    sensitivity_of,
    sigma_at,
    sliding_of,
    write_trace,
)

if TYPE_CHECKING:
    import pandas

__all__ = ["BodyTrace", "Trace", "dwell_times"]


@refusing()
@pointing(CALLED)
@displayed("png", "html")
@dataclass(frozen=True, eq=False)
class Trace:
    """The result of a simulation.

    Attributes
    ----------
    t : ndarray, shape (rows,), s
    microstep : ndarray of int, shape (rows,)
    x, v : ndarray, shape (rows,), m and m/s
    z : ndarray, shape (rows, n), m
        First variable of the chart.
    states : ndarray of str, shape (rows, n)
    s : ndarray, shape (rows, n)
        Thresholds ``w_i s(v)``, m.
    F : ndarray, shape (rows,), N
    F_elements : ndarray, shape (rows, n), N
    transitions : numpy.recarray
        Records with ``t, element`` (from 0), ``edge, source, target, z, v, s, F_before, F_after``.
    firings : Firings
        The same with codes in place of names, in a third of the memory.
    what : Mounted
        What ran; after `load` its model is a generic `ChartModel`.
    settings : dict
        Method, tolerances, engine and other settings.
    monitors : mapping of str to Verdict
        Verdicts of the monitors, by name; empty if the run had none.
    heading : str
        Title of the scenario that was run; empty if there is none.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> trace = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"),
    ...                  Prescribed("0.2"), 3.0)
    >>> str(trace.transitions.edge[0]), round(float(trace.transitions.t[0]), 9)
    ('break_away_forward', 2.0)
    """

    rows: Rows
    stops: Rows  # both sides of every stop; needed if `rows` has requested times only
    firings: Firings  # the log, with codes in place of names
    what: Mounted = field(repr=False)
    settings: Mapping[str, Setting]
    stored: Mapping[str, FloatArray] = field(default_factory=dict, repr=False)
    monitors: Mapping[str, Verdict] = field(default_factory=dict, repr=False)
    heading: str = field(default="", repr=False)
    which: str = field(default="", repr=False)  # the contact, of a system with several
    every: Firings | None = field(default=None, repr=False)  # of all contacts, where one is chosen
    initial: Mapping[str, Any] | None = field(default=None, repr=False)  # as given; not in files
    derived: Sensitivities | None = field(default=None, repr=False)  # if asked for; not in files

    def __repr__(self) -> str:
        return f"<Trace: {visible(self.title)}; {len(self)} rows, {len(self.firings)} transitions>"

    @property
    def title(self) -> str:
        """What ran: model and rig, or a system and its contacts."""
        if not self.subject.named:
            return f"{self.model.title}; {self.rig.title}"
        return f"{self.what.title}; {', '.join(self.what.machines)}"

    def __len__(self) -> int:
        return len(self.rows)

    def __getstate__(self) -> dict[str, Any]:
        """Return what is pickled: generated functions cannot be, and are made again."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    # ------------------------------------------------------------------ what ran
    @cached_property
    def subject(self) -> Mounted:
        """What is looked at: all that ran, or the contact chosen."""
        return self.what.only(self.which) if self.which else self.what

    @property
    def model(self) -> Model:
        """The model; of a system its contact, if it has only one or one is chosen."""
        return self.subject.model

    @property
    def rig(self) -> Rig:
        """The rig; of a system what moves its contacts."""
        return self.what.rig

    @property
    def system(self) -> System | None:
        """The system, where it is not a model on a rig."""
        return self.what.given

    # ------------------------------------------------------------------ columns
    @property
    def t(self) -> FloatArray:
        """Time, shape (rows,), s."""
        return self.rows.t

    @property
    def microstep(self) -> NDArray[np.int64]:
        """Micro-step of each row, shape (rows,)."""
        return self.rows.microstep

    @property
    def transitions(self) -> Any:
        """The log as a record array, made from the codes when it is first read."""
        return self.firings.records

    impulses = cached_property(impulses_of)
    sensitivity = sensitivity_of

    # ------------------------------------------------------------------ systems
    @cached_property
    def places(self) -> BankPlaces:
        """Where the quantities of the contact are: the only one, or the one chosen."""
        return self.program.layout.contact(self.which)

    @property
    def contacts(self) -> tuple[str, ...]:
        """Names of the contacts."""
        return tuple(bank.name for bank in self.program.layout.banks if bank.velocity)

    def contact(self, name: str) -> Trace:
        """Return the run as one contact sees it: its v, F, z, s, states and transitions.

        Parameters
        ----------
        name : str
            The contact's.

        Returns
        -------
        Trace
            The same rows; everything that shows a run of one model shows it.

        Raises
        ------
        ParameterError
            If there is no such contact.
        """
        bank = self.program.layout.contact(name)
        return contact_seen(self, bank.name) if self.what.named else self

    supervisor = contact

    def body(self, name: str) -> BodyTrace:
        """Return the motion of a body.

        Parameters
        ----------
        name : str
            The body's.

        Returns
        -------
        BodyTrace
            Its position and velocity at the rows.

        Raises
        ------
        ParameterError
            If there is no such body.
        """
        body = self.what.system.body(name)
        velocity = self.stored.get(body.v)
        if velocity is None or not body.driven:
            velocity = driven_velocity(self, body) if body.driven else self._named(body.v)
        return BodyTrace(name, self._named(body.x), velocity)

    def value(self, name: str) -> FloatArray:
        """Return a further state, sampled value or signal of the system, or what a contact has.

        Parameters
        ----------
        name : str
            As in the system's ``flow``, ``signals``, ``inputs`` or a `Sampled`; or what the chart
            calls a velocity or a force, such as ``"F_w"`` of a contact in the plane.

        Returns
        -------
        ndarray, shape (rows,)
            Its values.

        Raises
        ------
        ParameterError
            If there is no such value.
        """
        layout = self.program.layout
        if name in layout.y.shared:
            return self._named(name)
        bank = self.places if self.which or len(layout.banks) == 1 else None
        names = {} if bank is None else bank.plain({each: each for each in layout.observed.shared})
        names |= {u: u for u in self.what.system.names if u in self.seen}  # those of supervisors
        signals = self.what.system.signals if self.what.named else {}
        if isinstance(name, str) and name in signals:
            return np.array([given_values(self.what.system, t)[name] for t in self.t.tolist()])
        if isinstance(name, str) and name in names:
            return self.seen[names[name]]
        known = [*layout.y.shared, *(each for each in (*names, *signals) if " " not in each)]
        raise unknown("value", name, (u for u in known if u not in self.what.system.events))

    @property
    def x(self) -> FloatArray:
        """Position, shape (rows,), m."""
        position = self.places.position
        if position in self.program.layout.y.shared:
            return self._named(position)
        return self._seen(position)

    @property
    def n(self) -> int:
        """Number of elements."""
        return self.model.n

    @property
    def z(self) -> FloatArray:
        """First variable (the deflection) of every element, shape (rows, n), m."""
        bank = self.places
        if not bank.variables:
            return np.full((len(self.rows), bank.n), np.nan)
        return self._named(bank.of(bank.variables[0]))

    def variable(self, name: str) -> FloatArray:
        """Return a variable of the chart, shape (rows, n).

        Parameters
        ----------
        name : str
            One of ``model.chart.variables``.

        Returns
        -------
        ndarray, shape (rows, n)
            Values of the variable.

        Raises
        ------
        ParameterError
            If the chart has no such variable.
        """
        if name not in self.model.chart.variables:
            raise ParameterError(
                f"the chart has the variables {', '.join(self.model.chart.variables)}",
                place="name",
                value=name,
            )
        return self._named(self.places.of(name))

    def _seen(self, name: str) -> FloatArray:
        """Return what was observed with one value; NaN where a supervisor does not have it."""
        return self.seen[name] if name in self.seen else np.full(len(self.rows), np.nan)

    def _named(self, name: str) -> FloatArray:
        column: FloatArray = self.rows.y[:, self.program.layout.y.where(name)]
        return column

    @property
    def states(self) -> NDArray[np.str_]:
        """Active state of every element, shape (rows, n)."""
        return np.array([s.name for s in self.model.chart.states])[self.modes]

    @property
    def modes(self) -> NDArray[np.int64]:
        """Index of the active state of every element, shape (rows, n)."""
        return self.rows.mode[:, self.places.elements]

    @property
    def v(self) -> FloatArray:
        """Velocity, shape (rows,), m/s."""
        return self._seen(self.places.of(self.places.velocity))

    @property
    def s(self) -> FloatArray:
        """Thresholds, shape (rows, n), m; NaN where the model has no Stribeck curve."""
        return self.seen[self.places.of("s")]

    @property
    def F(self) -> FloatArray:
        """Friction force, shape (rows,), N."""
        return self._seen(self.places.of("F"))

    @property
    def shared(self) -> NDArray[np.bool_]:
        """Whether earlier contacts carry what would hold this locked one, shape (rows,).

        See the rule for locks that repeat each other in `gms_fsm.System`.
        """
        places = [self.places.of(f"{force} shared") for force in self.model.chart.force_names]
        found = [self.seen[place] > 0.0 for place in places if place in self.seen]
        return np.any(found, axis=0) if found else np.zeros(len(self.rows), dtype=bool)

    @property
    def F_elements(self) -> FloatArray:
        """Force of each element, shape (rows, n), N."""
        force = self.places.of("F_elements")
        return self.seen[force] if force in self.seen else np.full((len(self.rows), self.n), np.nan)

    @property
    def dz(self) -> FloatArray:
        """Rate of the first variable in the states of the row, shape (rows, n), m/s."""
        if not self.places.variables:
            return np.full((len(self.rows), self.places.n), np.nan)
        return self.seen[self.places.of(f"d{self.places.variables[0]}")]

    @property
    def sliding(self) -> Any:
        """Intervals in which the motion slides on a surface (see `integrators.sliding`).

        There a sign is held between -1 and 1, or an element between two states: `states` has the
        one entered last. Records with ``t_start, t_end`` [s], ``surface`` (the quantity that is
        zero there, such as ``v``, or with both states ``p - q (below, above) of element 1``) and
        ``sigma_start, sigma_end``, the sign held at both ends; between two states -1 is the first.
        They are found from the rows and the stops; a run of which only the end was kept has none.
        """
        return sliding_of(self)

    def sigma(self, row: int) -> dict[str, float]:
        """Return the signs held between -1 and 1 at a row.

        Parameters
        ----------
        row : int
            Row index.

        Returns
        -------
        dict of str to float
            Keyed by the quantity that is zero there, such as ``v``; empty at most rows.
        """
        row = checked_integer("row", row)
        on = np.flatnonzero(self.rows.mode[row, self.program.layout.slides])
        names = self.program.surface_names
        return {names[k]: sigma_at(self.program, self.rows, row, int(k)) for k in on}

    @cached_property
    def program(self) -> Program:
        """The generated program of the run."""
        system = self.what.system  # a trace that is made later has its program from here on
        return vars(self).get("program") or lower(system)

    @cached_property
    def seen(self) -> Mapping[str, FloatArray]:
        """What was observed, by its name in the layout; elements on the second axis."""
        if self.stored:
            return self.stored
        compiled = self.settings.get("engine") == "compiled"
        return Observed(self.program, self.rows, compiled=compiled)

    # ------------------------------------------------------------------ sampling
    def sample(self, times: ArrayLike) -> Trace:
        """Return the run at other times, interpolated within arcs and never across an event.

        The interpolation is cubic Hermite between adjacent rows, with one-sided slopes from the
        flow. At an event the value is the one after it. For full accuracy on a dense grid, pass
        `t_eval` to `simulate`.

        Parameters
        ----------
        times : array_like, shape (m,)
            Times within the run, s.

        Returns
        -------
        Trace
            With rows at exactly these times, in this order, and the same transitions.

        Raises
        ------
        ParameterError
            If a time is outside the run.
        SignalError
            If the trace comes from a file and its signal was a Python function.
        """
        return sampled(self, times)

    def refined(self, points: int) -> Trace:
        """Return the rows with evenly spaced samples between them, for smooth curves.

        Parameters
        ----------
        points : int
            Number of samples over the whole run.

        Returns
        -------
        Trace
            All rows of this trace, including micro-steps, and the samples.
        """
        points = checked_integer("points", points, 1)
        even = self.sample(np.linspace(self.t[0], self.t[-1], points)).rows
        inner = ~np.isin(even.t, self.t)
        rows = merged(even.at(inner), self.rows)
        return replace(self, rows=rows, stops=rows, stored={})

    def whole(self) -> Trace:
        """Return the run with both sides of every stop added to the requested rows.

        Returns
        -------
        Trace
            This trace if it already has them.
        """
        table = merged(self.rows, self.stops)
        same = len(table) == len(self.rows)
        return self if same else replace(self, rows=table, stops=table, stored={})

    def with_monitors(self, found: Mapping[str, Verdict]) -> Trace:
        """Return the same run with the verdicts of its monitors, and all that was computed."""
        trace = replace(self, monitors=found)
        vars(trace).update({**vars(self), "monitors": found})
        return trace

    def trust(self, *, again: bool = False) -> Trust:
        """Return what this run says about its own result, from its rows, log and program.

        Parameters
        ----------
        again : bool
            Also repeat the run with a hundredth of the tolerances, and compare.

        Returns
        -------
        Trust
            Its `findings`, of the kinds in `gms_fsm.traces.verdicts`, warnings first.

        Examples
        --------
        >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
        >>> trace = simulate(GMS(GMSParameters.paper("stick-slip"), law="published"),
        ...                  Prescribed("0.15*sin(2*pi*t/25)"), 30.0)
        >>> [each.kind for each in trace.trust().warnings]
        ['growth']
        """
        key, find = f"trust, again {again}", asked("trust")
        if key not in vars(self) and find is not None:  # this package declares it
            vars(self)[key] = find(self, again=again)
        return vars(self)[key]  # type: ignore[no-any-return]

    # ------------------------------------------------------------------ files
    def save(self, path: str | Path) -> Path:
        """Write the trace to ``.npz``, or to ``.csv`` with the log in a second file.

        The file is written completely or not at all. CSV numbers are printed so that they read
        back equal; the log is written to ``<name>.transitions.csv``. `numpy.load` reads ``.npz``
        too; its ``log_machine`` and ``log_edge`` count over all contacts.

        Parameters
        ----------
        path : str or Path
            File name ending in ``.npz`` or ``.csv``.

        Returns
        -------
        Path
            The file written.

        Raises
        ------
        OutputError
            If the folder is not writable, the file name has another ending, or the trace is what
            one contact sees of a run.
        """
        return write_trace(self, checked_path("path", path))

    @classmethod
    def load(cls, path: str | Path) -> Trace:
        """Read a trace written by `save`.

        Parameters
        ----------
        path : str or Path
            The ``.npz`` or ``.csv`` file.

        Returns
        -------
        Trace
            With arrays equal to those saved.

        Raises
        ------
        TraceFileError
            If the file is missing, damaged or not a trace; nothing in it is executed.
        """
        path = checked_path("path", path)
        parts = read_parts(path)
        return cls(
            parts.rows,
            parts.stops,
            parts.firings,
            parts.ran.what,
            parts.header.chosen,
            parts.stored,
            parts.header.monitors,
            parts.header.heading,
        )

    # ------------------------------------------------------------------ tables
    def columns(self) -> dict[str, NDArray[Any]]:
        """Return the rows as flat columns, whose names number elements from 1.

        Returns
        -------
        dict of str to ndarray, shape (rows,)
            ``t, microstep, x, v, F, z1.., state1.., s1.., F1..``, and ``slides1..``: 1 where the
            motion slides along a surface. Of a system positions, velocities and further states by
            their names, and for each contact such columns with its name: ``pad.v, pad.z1..``.
        """
        return columns_of(self)

    def to_pandas(self) -> pandas.DataFrame:
        """Return the rows as a pandas DataFrame, one column per quantity and element.

        Returns
        -------
        pandas.DataFrame
            See `columns`.

        Raises
        ------
        MissingExtraError
            If pandas is not installed.
        """
        return require("pandas", "pandas").DataFrame(self.columns())

    def transitions_csv(self) -> str:
        """Return the transition log as CSV text, with elements numbered from 1.

        Returns
        -------
        str
            With a header line.
        """
        from gms_fsm.traces.files.csv_files import log_texts

        return "".join(log_texts(self.firings))
