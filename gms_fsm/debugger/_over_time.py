"""What happened over time, as plain data: states, velocity and force, firings."""

from __future__ import annotations

from dataclasses import dataclass

from gms_fsm.session.session import Fired, Session
from gms_fsm.session.tree.branch import Branch


@dataclass(frozen=True)
class Ribbons:
    """The states of all elements over time.

    Parameters
    ----------
    start, end : float
        Start and end time, s.
    modes : tuple of (tuple of int or None)
        State index of each element, for equal parts of that time; None where the branch has not
        been computed.
    now : int
        The part that contains the cursor.
    """

    start: float
    end: float
    modes: tuple[tuple[int, ...] | None, ...]
    now: int


@dataclass(frozen=True)
class EventView:
    """One firing.

    Parameters
    ----------
    row : int
        The row it made.
    t : float
        Time, s.
    fired : Fired
        What fired.
    """

    row: int
    t: float
    fired: Fired


def ribbons(
    session: Session,
    parts: int,
    *,
    branch: int | None = None,
    span: tuple[float, float] | None = None,
) -> Ribbons:
    """Return the states of all elements over time."""
    start, end = span or (session.branch.raw(0).t, session.t_end)
    shown = session.tree.branch(branch)
    rows = _sampled(shown, start, end, parts)
    modes = tuple(None if row is None else shown.raw(row).mode for row in rows)
    return Ribbons(start, end, modes, _part(session, parts, (start, end)))


def _part(session: Session, parts: int, span: tuple[float, float]) -> int:
    """Return the part of a time span that contains the cursor."""
    start, end = span
    return min(parts - 1, int(parts * (session.here.t - start) / (end - start)))


def _sampled(branch: Branch, start: float, end: float, parts: int) -> list[int | None]:
    """Return the row in the middle of each part of a time span; None where none is known."""
    rows: list[int | None] = []
    for part in range(parts):
        row = branch.row_at(start + (end - start) * (part + 0.5) / parts)
        # The states of the last row are known only up to its time.
        reached = row + 1 < len(branch) or branch.ended
        rows.append(row if row >= 0 and reached else None)
    return rows


def curves(
    session: Session, machine: int, parts: int, span: tuple[float, float]
) -> dict[str, tuple[float | None, ...]]:
    """Return velocity and force of a contact over time."""
    branch, contact = session.branch, session.start.program.layout.bank(machine).name
    found: dict[str, list[float | None]] = {"v": [], "F": []}
    rows = [None if row is None else branch.raw(row) for row in _sampled(branch, *span, parts)]
    rows[_part(session, parts, span)] = branch.here  # what the other panes show
    for row in rows:
        scope = None if row is None else branch.scope(row, contact)
        for name, values in found.items():
            values.append(None if scope is None else getattr(scope, name))
    return {name: tuple(values) for name, values in found.items()}


def events(session: Session, *, ahead: bool = False) -> tuple[EventView, ...]:
    """Return the firings of the current branch, in the order of their rows."""
    branch = session.branch
    rows = branch.firing_rows(len(branch) if ahead else branch.cursor + 1)
    log = branch.log()  # one record for each of these rows
    return tuple(
        EventView(
            row,
            record.t,
            Fired(record.element, record.edge, record.source, record.target, record.contact),
        )
        for row, record in zip(rows, log, strict=False)
    )
