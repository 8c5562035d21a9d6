"""The firings of a run: numbers, and a code for everything that has a name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import TraceFileError
from gms_fsm.foundation.display import Log
from gms_fsm.lowering.layout import SystemLayout
from gms_fsm.lowering.log_columns import CONTACT, LOG_NUMBERS, LOG_TEXTS, LogRecord

Codes = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Firings:
    """The transition log with codes in place of names: 56 bytes for each firing.

    Parameters
    ----------
    t : ndarray, shape (firings,), s
    machine, edge : ndarray of int, shape (firings,)
        Counted over all contacts.
    numbers : ndarray, shape (firings, 5)
        In the order of `LOG_NUMBERS`.
    layout : SystemLayout
        Of the run. It has the names.
    named : bool
        Whether records name their contact.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> trace = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"),
    ...                  Prescribed("0.2"), 3.0)
    >>> firings = trace.firings
    >>> firings.edge.tolist(), str(firings.records.edge[0])
    ([0, 0, 0, 0], 'break_away_forward')
    """

    t: FloatArray
    machine: Codes
    edge: Codes
    numbers: FloatArray
    layout: SystemLayout
    named: bool

    def __len__(self) -> int:
        return int(self.t.size)

    @classmethod
    def counted(
        cls, t: Any, machine: Any, edge: Any, numbers: Any, layout: SystemLayout, *, of_system: bool
    ) -> Firings:
        """Return firings from columns of their own, with codes of any length."""
        codes = machine.astype(np.int32), edge.astype(np.int32)
        return cls(t, *codes, numbers, layout, of_system and t.size > 0)

    @classmethod
    def of(cls, records: Iterable[LogRecord], layout: SystemLayout, *, of_system: bool) -> Firings:
        """Return the firings of a run from its records."""
        rows = list(records)
        values = zip(*rows, strict=True) if rows else ((),) * len(LogRecord._fields)
        columns: dict[str, Any] = dict(zip(LogRecord._fields, values, strict=True))
        if not (of_system and rows):
            del columns[CONTACT]
        return cls.coded(columns, layout, of_system=of_system)

    @classmethod
    def coded(cls, columns: Mapping[str, Any], layout: SystemLayout, *, of_system: bool) -> Firings:
        """Return the firings that columns with names describe."""
        count = len(columns["t"])
        if (CONTACT in columns) != (of_system and count > 0):
            raise TraceFileError("the transition log does not have the columns of a trace")
        banks = {bank.name: bank for bank in layout.banks}
        whose = columns.get(CONTACT, [layout.banks[0].name] * count)
        if not banks.keys() >= set(whose):
            raise TraceFileError("the transition log names a contact that the system does not have")
        element = np.asarray(columns["element"], dtype=np.int64)
        sizes = np.array([banks[name].n for name in whose], dtype=np.int64)
        if not ((element >= 0) & (element < sizes)).all():
            raise TraceFileError("the transition log names an element that the model does not have")
        texts = zip(whose, *(columns[name] for name in LOG_TEXTS), strict=True)
        try:
            edge = [layout.edge_codes[each] for each in texts]
        except KeyError:
            raise TraceFileError(
                "the transition log names an edge that the chart does not have"
            ) from None
        first = np.array([banks[name].first for name in whose], dtype=np.int64)
        numbers = np.empty((count, len(LOG_NUMBERS)))
        for place, name in zip(numbers.T, LOG_NUMBERS, strict=True):
            place[:] = columns[name]
        return cls(
            np.array(columns["t"], dtype=np.float64),
            (first + element).astype(np.int32),
            np.array(edge, dtype=np.int32),
            numbers,
            layout,
            CONTACT in columns,
        )

    def at(self, chosen: NDArray[Any] | slice) -> Firings:
        """Return some of the firings."""
        return replace(
            self,
            t=self.t[chosen],
            machine=self.machine[chosen],
            edge=self.edge[chosen],
            numbers=self.numbers[chosen],
        )

    def within(self, contact: str) -> NDArray[np.bool_]:
        """Return which firings are those of a contact."""
        mine = self.layout.contact(contact).elements
        return np.asarray((self.machine >= mine.start) & (self.machine < mine.stop))

    def of_contact(self, name: str) -> Firings:
        """Return the firings of a contact."""
        return self if len(self.layout.banks) == 1 else self.at(self.within(name))

    def followed_by(self, other: Firings) -> Firings:
        """Return these firings and then those of another run of the same system."""
        return replace(
            self,
            t=np.concatenate([self.t, other.t]),
            machine=np.concatenate([self.machine, other.machine]),
            edge=np.concatenate([self.edge, other.edge]),
            numbers=np.concatenate([self.numbers, other.numbers]),
            named=self.named or other.named,
        )

    @cached_property
    def records(self) -> Any:
        """The record array of `Trace.transitions`, in which names are texts."""
        layout = self.layout
        whose = layout.owners(self.machine)
        columns: dict[str, NDArray[Any]] = {"t": self.t}
        columns["element"] = self.machine - layout.firsts[whose]
        texts = zip(LOG_TEXTS, layout.log_texts, strict=True)
        columns |= {name: text[self.edge] for name, text in texts}
        columns |= zip(LOG_NUMBERS, self.numbers.T, strict=True)
        if self.named:
            columns[CONTACT] = np.array([bank.name for bank in layout.banks])[whose]
        log = np.empty(len(self), dtype=[(name, column.dtype) for name, column in columns.items()])
        for name, column in columns.items():
            log[name] = column
        return log.view(Log)
