"""What a debugger shows of a session, as plain data: no text is laid out here."""

from __future__ import annotations

from dataclasses import dataclass

from gms_fsm.inspection._branch import Branch
from gms_fsm.inspection.session import Session

__all__ = [
    "BranchView",
    "EdgeView",
    "ElementView",
    "Ribbons",
    "StateView",
    "View",
    "branches",
    "chart_states",
    "ending",
    "ribbons",
    "view",
]


@dataclass(frozen=True)
class EdgeView:
    """An edge of a chart, as an element sees it.

    Parameters
    ----------
    name, target, guard : str
        Its name, the state it leads to, its guard as the chart shows it.
    priority : int
        From 1, among the edges of its state.
    clauses : tuple of bool or None
        The truth of each part of the guard; None where it cannot be computed. Empty where the guard
        is not asked.
    fired : bool
        Whether it was taken at this row.
    """

    name: str
    target: str
    guard: str
    priority: int
    clauses: tuple[bool | None, ...]
    fired: bool


@dataclass(frozen=True)
class ElementView:
    """One element at the cursor.

    Parameters
    ----------
    number : int
        Counted from 1.
    state : str
        Its active state.
    variables : tuple of float
        In the chart's order.
    s, ratio : float or None
        The threshold, m, and the first variable against it; None where the chart has none.
    F : float
        N.
    edges : tuple of EdgeView
        The edges that are asked, by priority.
    """

    number: int
    state: str
    variables: tuple[float, ...]
    s: float | None
    ratio: float | None
    F: float
    edges: tuple[EdgeView, ...]


@dataclass(frozen=True)
class View:
    """One screen: where the session stands.

    Parameters
    ----------
    branch, row, microstep : int
        The place.
    located : bool
        Whether it lies between this row and the next.
    t, x, v, F : float
        s, m, m/s, N.
    ending : str
        ``"end"`` at the end of the run, why it cannot go on at a failure, else empty.
    elements : tuple of ElementView
        All of them.
    """

    branch: int
    row: int
    microstep: int
    located: bool
    t: float
    x: float
    v: float
    F: float
    ending: str
    elements: tuple[ElementView, ...]


@dataclass(frozen=True)
class Ribbons:
    """The states of all elements over time.

    Parameters
    ----------
    start, end : float
        s.
    modes : tuple of (tuple of int or None)
        For equal parts of that time: each element's state, by its place in the chart; None where
        the branch is not computed.
    now : int
        The part in which the cursor stands.
    """

    start: float
    end: float
    modes: tuple[tuple[int, ...] | None, ...]
    now: int


@dataclass(frozen=True)
class StateView:
    """A state of the chart, as one element sees it.

    Parameters
    ----------
    name : str
        The state's.
    active : bool
        Whether the element is in it.
    flow : tuple of (str, str)
        Variable and the text of its rate.
    edges : tuple of EdgeView
        That leave it, by priority.
    """

    name: str
    active: bool
    flow: tuple[tuple[str, str], ...]
    edges: tuple[EdgeView, ...]


@dataclass(frozen=True)
class BranchView:
    """One branch of a session.

    Parameters
    ----------
    number, rows, transitions : int
        Its number, and how much of it is computed.
    current : bool
        Whether the cursor is in it.
    t_computed : float
        s, the last row's.
    outcome : str
        Empty while it goes on, ``"end"``, or why it cannot go on.
    parent : int or None
        The branch it left.
    t_fork : float or None
        s, where it left that.
    edits : str
        What was poked there.
    """

    number: int
    rows: int
    transitions: int
    current: bool
    t_computed: float
    outcome: str
    parent: int | None
    t_fork: float | None
    edits: str


def view(session: Session) -> View:
    """Return what a session shows at its cursor.

    Parameters
    ----------
    session : Session
        What is walked.

    Returns
    -------
    View
        Plain data.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> session = Session(GMS(GMSParameters.paper("stick-slip"), law="published"),
    ...                   Prescribed("0.15"), 1.0)
    >>> [each.state for each in view(session).elements]
    ['stick', 'stick', 'stick', 'stick']
    """
    here = session.here
    return View(
        session.current,
        here.row,
        here.microstep,
        here.located,
        here.t,
        here.x,
        here.v,
        here.F,
        ending(session),
        tuple(_element(session, i) for i in range(session.model.n)),
    )


def ending(session: Session) -> str:
    """Return what there is to say at the last row of a branch.

    Parameters
    ----------
    session : Session
        What is walked.

    Returns
    -------
    str
        ``"end"`` at the end of the run, why it cannot go on at a failure; empty before that.
    """
    here, branch = session.here, session.branch
    at_last = here.row + 1 == len(branch) and not here.located
    return _outcome(branch) if at_last else ""


def _outcome(branch: Branch) -> str:
    if branch.failure is not None:
        return branch.failure.happened
    return "end" if branch.ended else ""


def _element(session: Session, i: int) -> ElementView:
    here, chart, branch = session.here, session.model.chart, session.branch
    scope = branch.scope(branch.here)
    edges = tuple(
        EdgeView(
            each.edge.name,
            each.edge.target,
            chart.guard_text(each.edge.name),
            each.priority,
            tuple(clause.holds if clause.computable else None for clause in each.clauses),
            each.fired,
        )
        for each in session.why(i)
    )
    has_s = "s" in chart.inputs
    return ElementView(
        i + 1,
        here.states[i],
        tuple(scope.each(name)[i] for name in chart.variables),
        here.s[i] if has_s else None,
        abs(here.z[i]) / here.s[i] if has_s else None,
        here.F_elements[i],
        edges,
    )


def chart_states(session: Session, i: int) -> tuple[StateView, ...]:
    """Return the chart as an element sees it: which state is active, which guards are asked.

    Parameters
    ----------
    session : Session
        What is walked.
    i : int
        The element, counted from 0.

    Returns
    -------
    tuple of StateView
        In the chart's order.
    """
    chart, element = session.model.chart, _element(session, i)
    asked = {each.name: each for each in element.edges}
    active = session.here.states[i]
    return tuple(
        StateView(
            state.name,
            state.name == active,
            tuple(state.flow.items()),
            tuple(
                asked.get(edge.name)
                or EdgeView(
                    edge.name, edge.target, chart.guard_text(edge.name), priority, (), False
                )
                for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1)
            ),
        )
        for state in chart.states
    )


def ribbons(session: Session, parts: int) -> Ribbons:
    """Return the states of all elements over the whole time.

    Parameters
    ----------
    session : Session
        What is walked.
    parts : int
        How many equal parts of the time to show.

    Returns
    -------
    Ribbons
        The states in the middle of each part.
    """
    branch, start, end = session.branch, session.branch.raw(0).t, session.t_end
    modes: list[tuple[int, ...] | None] = []
    for part in range(parts):
        t = start + (end - start) * (part + 0.5) / parts
        row = branch.row_at(t)
        # The last row's states are known up to its time only.
        reached = row + 1 < len(branch) or branch.ended
        modes.append(branch.raw(row).mode if row >= 0 and reached else None)
    now = min(parts - 1, int(parts * (session.here.t - start) / (end - start)))
    return Ribbons(start, end, tuple(modes), now)


def branches(session: Session) -> tuple[BranchView, ...]:
    """Return all branches of a session.

    Parameters
    ----------
    session : Session
        What is walked.

    Returns
    -------
    tuple of BranchView
        By number.
    """
    return tuple(
        BranchView(
            number,
            len(branch),
            len(branch.log()),
            number == session.current,
            branch.last.t,
            _outcome(branch),
            branch.parent,
            None if branch.parent is None else branch.raw(branch.fork + 1).t,
            "" if branch.edits is None else str(branch.edits),
        )
        for number, branch in enumerate(session.branches)
    )
