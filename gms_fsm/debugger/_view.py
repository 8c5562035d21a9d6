"""The display of the debugger as plain data, without text layout."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from gms_fsm.charts.chart import Chart
from gms_fsm.foundation.quantities import Scale, per_second, quantity, scale_of
from gms_fsm.lowering.layout import BankPlaces
from gms_fsm.session.elements import chart_of
from gms_fsm.session.here import why_at
from gms_fsm.session.results import ContactHere, Fired
from gms_fsm.session.session import Session
from gms_fsm.session.tree.branch import Branch


@dataclass(frozen=True)
class EdgeView:
    """An edge of a chart, for one element.

    Parameters
    ----------
    name, target, guard : str
        Name, target state, and guard as shown in the chart.
    priority : int
        Priority among the edges of its source state, from 1.
    clauses : tuple of bool or None
        Truth of each clause of the guard; None if it cannot be computed. Empty if the guard is not
        evaluated.
    fired : bool
        Whether the edge was taken at this row.
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
        Element number, from 1.
    state : str
        Active state.
    variables : tuple of float
        Values in the order of the chart.
    s, ratio : float or None
        Threshold, m, and ratio of the first variable to it; None if the chart has no threshold.
    F : float
        Force, N.
    edges : tuple of EdgeView
        The edges evaluated, by priority.
    """

    number: int
    state: str
    variables: tuple[float, ...]
    s: float | None
    ratio: float | None
    F: float
    edges: tuple[EdgeView, ...]


@dataclass(frozen=True)
class ContactView:
    """One contact at the cursor; of a model on a rig there is one, without a name.

    Parameters
    ----------
    name, title : str
        Name, and what it is; both empty for a model on a rig.
    chart : Chart
        Its chart.
    first : int
        Number of its first element, counted over all contacts from 0.
    here : ContactHere
        Its position, velocity and force.
    elements : tuple of ElementView
        Its elements.
    """

    name: str
    title: str
    chart: Chart
    first: int
    here: ContactHere
    elements: tuple[ElementView, ...]

    @property
    def scales(self) -> Mapping[str, Scale]:
        """The units in which a table of its elements is written, one for each column.

        A threshold has that of the variable it is compared with, F_i that of F.
        """
        found: dict[str, Scale] = {}
        columns = zip(*(each.variables for each in self.elements), strict=True)
        for name, values in zip(self.chart.variables, columns, strict=False):
            bounds = () if found else [each.s for each in self.elements if each.s is not None]
            found[name] = scale_of((*values, *bounds), self.chart.unit(name))
        length = next(iter(found.values()), Scale(0, self.chart.length))
        return found | {"s": length, "F": self.here.scales["F"]}


@dataclass(frozen=True)
class BodyView:
    """One body of a system at the cursor.

    Parameters
    ----------
    name : str
        Its name.
    x, v : (str, float)
        Name and value of its position and of its velocity.
    driven : bool
        Whether its velocity is given.
    unit : str
        Of its position.
    """

    name: str
    x: tuple[str, float]
    v: tuple[str, float]
    driven: bool
    unit: str

    def text(self) -> str:
        """Return name and value of position and velocity, with units."""
        (x, position), (v, velocity) = self.x, self.v
        speed = quantity(velocity, per_second(self.unit))
        return f"{x} = {quantity(position, self.unit)}, {v} = {speed}"


@dataclass(frozen=True)
class ValueView:
    """Further values of a system at the cursor.

    Parameters
    ----------
    title : str
        What they are, such as ``signals``.
    values : mapping of str to float
        By name.
    tick : float or None
        Of sampled values, when they change next, s; None if they never do, or are not sampled.
    """

    title: str
    values: Mapping[str, float]
    tick: float | None = None


@dataclass(frozen=True)
class Screen:
    """One screen: the current position of the session.

    Parameters
    ----------
    branch, row, microstep : int
        The position.
    located : bool
        Whether the position is between this row and the next.
    t : float
        Time, s.
    fired : Fired or None
        The firing that made this row.
    ending : str
        ``"end"`` at the end of the run, the reason at a failure, else empty.
    contacts : tuple of ContactView
        All contacts.
    bodies : tuple of BodyView
        The bodies of a system; none for a model on a rig.
    values : tuple of ValueView
        Further states, sampled values and signals of a system.
    """

    branch: int
    row: int
    microstep: int
    located: bool
    t: float
    fired: Fired | None
    ending: str
    contacts: tuple[ContactView, ...]
    bodies: tuple[BodyView, ...] = ()
    values: tuple[ValueView, ...] = ()

    @property
    def elements(self) -> tuple[ElementView, ...]:
        """All elements of all contacts."""
        return tuple(each for contact in self.contacts for each in contact.elements)


@dataclass(frozen=True)
class StateView:
    """A state of the chart, for one element.

    Parameters
    ----------
    name : str
        Name of the state.
    active : bool
        Whether the element is in this state.
    flow : tuple of (str, str)
        Variables with the texts of their rates.
    locked : bool
        Whether it holds the velocity at 0.
    forces : tuple of (str, str)
        Forces with their texts, where the state gives its own.
    edges : tuple of EdgeView
        Edges that leave the state, by priority.
    """

    name: str
    active: bool
    flow: tuple[tuple[str, str], ...]
    locked: bool
    forces: tuple[tuple[str, str], ...]
    edges: tuple[EdgeView, ...]


@dataclass(frozen=True)
class BranchView:
    """One branch of a session.

    Parameters
    ----------
    number, rows, transitions : int
        Branch number, and numbers of computed rows and transitions.
    current : bool
        Whether this is the current branch.
    t_computed : float
        Time of the last computed row, s.
    outcome : str
        Empty if not finished, ``"end"``, or the reason why it cannot continue.
    parent : int or None
        Number of the parent branch.
    t_fork : float or None
        Time of the poke, s.
    edits : str
        The changed values.
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


def view(session: Session) -> Screen:
    """Return the screen at the cursor of a session.

    Parameters
    ----------
    session : Session
        The session.

    Returns
    -------
    View
        The screen as plain data.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> session = Session(GMS(GMSParameters.paper("stick-slip"), law="published"),
    ...                   Prescribed("0.15"), 1.0)
    >>> [each.state for each in view(session).elements]
    ['stick', 'stick', 'stick', 'stick']
    """
    here, start = session.here, session.start
    bodies: tuple[BodyView, ...] = ()
    values: tuple[ValueView, ...] = ()
    if start.what.named:
        bodies = tuple(
            BodyView(
                body.name,
                (body.x, here.bodies[body.name].x),
                (body.v, here.bodies[body.name].v),
                body.driven,
                body.unit,
            )
            for body in start.system.bodies
        )
        values = _values(session)
    return Screen(
        session.current,
        here.row,
        here.microstep,
        here.located,
        here.t,
        here.fired,
        ending(session),
        tuple(_contact(session, bank) for bank in start.program.layout.banks),
        bodies,
        values,
    )


def _contact(session: Session, bank: BankPlaces) -> ContactView:
    start, here = session.start, session.here.contacts[bank.name]
    part = start.system.contact(bank.name)
    name, title = (bank.name, part.title) if start.what.named else ("", "")
    elements = tuple(element_view(session, bank.first + i) for i in range(bank.n))
    return ContactView(
        name,
        title,
        part.chart,
        bank.first,
        here,
        elements,
    )


def _values(session: Session) -> tuple[ValueView, ...]:
    """Return further states, sampled values and signals of a system."""
    system, here, values = session.system, session.here, session.values()
    found = []
    if system.flow:
        found.append(ValueView("further states", {name: here.values[name] for name in system.flow}))
    for bit, each in enumerate(system.sampled):
        own = {name: here.values[name] for name in each.updates}
        found.append(ValueView(f"sampled {each.name}", own, session.branch.tick_after(here.t, bit)))
    if system.signals:
        found.append(ValueView("signals", {name: values[name] for name in system.signals}))
    return tuple(found)


def ending(session: Session) -> str:
    """Return the outcome at the last row of a branch."""
    here, branch = session.here, session.branch
    at_last = here.row + 1 == len(branch) and not here.located
    return _outcome(branch) if at_last else ""


def _outcome(branch: Branch) -> str:
    if branch.failure is not None:
        return branch.failure.happened
    return "end" if branch.ended else ""


def element_view(session: Session, machine: int) -> ElementView:
    """Return one element, counted over all contacts, at the cursor."""
    start, branch = session.start, session.branch
    bank = start.program.layout.bank(machine)
    chart, i = chart_of(start, bank), machine - bank.first
    here = session.here.contacts[bank.name]
    scope = branch.scope(branch.here, bank.name)
    edges = tuple(
        EdgeView(
            each.edge.name,
            each.edge.target,
            chart.guard_text(each.edge.name),
            each.priority,
            tuple(clause.holds if clause.computable else None for clause in each.clauses),
            each.fired,
        )
        for each in why_at(branch, machine, "")
    )
    threshold = here.s[i] if "s" in chart.inputs else None
    comparable = threshold is not None and bool(chart.variables)
    return ElementView(
        i + 1,
        here.states[i],
        tuple(scope.each(name)[i] for name in chart.variables),
        threshold if comparable else None,
        abs(here.z[i]) / here.s[i] if comparable else None,
        here.F_elements[i],
        edges,
    )


def chart_states(session: Session, machine: int) -> tuple[StateView, ...]:
    """Return the chart for an element: the active state, and the guards evaluated."""
    start, element = session.start, element_view(session, machine)
    chart = chart_of(start, start.program.layout.bank(machine))
    asked = {each.name: each for each in element.edges}
    active = element.state
    return tuple(
        StateView(
            state.name,
            state.name == active,
            tuple(state.flow.items()),
            state.locked,
            tuple(state.outputs.items()),
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


def branches(session: Session) -> tuple[BranchView, ...]:
    """Return all branches of a session."""
    return tuple(
        BranchView(
            number,
            len(branch),
            len(branch.log()),
            number == session.current,
            branch.last.t,
            _outcome(branch),
            branch.parent,
            None if branch.parent is None else session.tree.beginning(number),
            session.tree.forks[number].changes,
        )
        for number, branch in zip(session.tree.forks, session.branches, strict=True)
    )
