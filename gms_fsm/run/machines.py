"""The elements as `transitions` machines, and the generated if-else code as an alternative.

One `transitions.Machine` serves n element objects. The engine evaluates a table read from that
machine (its transitions and the guards that are their conditions) and fires through the machine, so
that callbacks registered by a user (``on_enter_slip``, ``after`` ...) run once per firing.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from transitions import Machine, MachineError

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.nesting import spelled
from gms_fsm.errors import ChartError, ParameterError, shown
from gms_fsm.foundation.arguments import checked_kind, refusing
from gms_fsm.language import PYTHON, Condition, names_in, spell
from gms_fsm.lowering.generated import CarefulText, ieee, load
from gms_fsm.lowering.program import Arguments, Program
from gms_fsm.systems.models import Model
from gms_fsm.traces.scope import GuardValues, parameter_values
from integrators import JUMPED

__all__ = ["Element", "ElementMachines", "IfElse", "Interference"]


class Element:
    """One Maxwell element: the model object of its machine.

    Callbacks can read: ``t`` [s], ``x`` [m], ``v`` [m/s], the threshold ``s``, each variable
    (``z`` [m]) and each parameter (``k``, ``sigma``, ``C``, ``v_c``) of the chart, the current
    ``state`` (one inside others is spelled ``slip__forward``) and the element's ``index`` counted
    from 0. Parameters are read-only: the run is integrated with those of the model. Values of the
    run cannot be set while it goes on; before it they can, for
    ``element.may_break_away_forward()``. Derive from it to give elements methods that `transitions`
    calls by name, for example ``on_enter_slip(self, event)``.
    """

    # No __slots__ and no generated __eq__: transitions fails with the former, and registers models
    # that compare equal only once.
    state: str
    index: int
    t: float
    x: float
    v: float
    s: float
    _fixed: frozenset[str] = frozenset()  # parameters
    _live: frozenset[str] = frozenset()  # what a run shows
    _firing: Sequence[bool] = (False,)  # whether a machine of the run fires

    def __setattr__(self, name: str, value: Any) -> None:
        if self._firing[0] and name in self._live:
            raise Interference(
                f"a callback set {name} of element {self.index + 1} to {shown(value)}; {ONLY_LOOK}",
                advice="write the assignment into the chart: actions of the edge, or entry or exit "
                "of a state",
            )
        if name in self._fixed:
            raise ParameterError(
                f"{name} is set to {shown(value)}, but parameters of an element are "
                "read-only: the flow would not follow. Change them between runs "
                "(with_values(model, ...)), or make the number a variable of the chart "
                "with the flow '0' and assign it in an action",
                place=f"element {self.index + 1}",
            )
        object.__setattr__(self, name, value)

    if not TYPE_CHECKING:  # which knows all attributes there are

        def __getattr__(self, name):
            """Say what to do where a value is read before a run shows it."""
            if name not in self._live:
                raise AttributeError(
                    f"{type(self).__name__!r} object has no attribute {name!r}", name=name, obj=self
                )
            raise AttributeError(
                f"element {self.index + 1} has no {name!r} before a run: run first, with "
                "simulate(..., engine=machines), or set what guards and callbacks read: "
                f"element.{name} = ...",
                name=name,
                obj=self,
            )


class Guard:
    """A guard as a condition of `transitions`: called with an event, or evaluated directly."""

    def __init__(self, edge: str, condition: Condition) -> None:
        self.edge, self.condition = edge, condition
        names = {name: f"element.{name}" for name in names_in(condition)}
        self.text = self.__name__ = spell(condition, PYTHON)  # transitions draws the name
        self.held = False  # at the last call
        source = f"def holds(element):\n    return {spell(condition, PYTHON, names)}\n"
        self.holds: Callable[[Element], bool] = ieee(
            load(f"guard {edge}", source)["holds"], CarefulText(f"guard {edge}", source)["holds"]
        )

    def __reduce__(self) -> tuple[type[Guard], tuple[str, Condition]]:
        return Guard, (self.edge, self.condition)  # its function is generated

    def __call__(self, event: Any) -> bool:
        self.held = self.holds(event.model)
        return self.held

    def __repr__(self) -> str:
        return f"<guard {self.text}>"


@refusing(quick=("table",))
class ElementMachines:
    """n elements of a model, each in a state of one shared `transitions.Machine`.

    Parameters
    ----------
    model : Model or Contact
        The model, or the contact of a system, whose elements are created.
    element : type, optional
        Class of the element objects: `Element` or a class derived from it.
    machine : callable, optional
        Makes the machine: a class such as `transitions.extensions.GraphMachine`, or one with
        arguments of its own, ``functools.partial(GraphMachine, graph_engine="mermaid")``. Not an
        asynchronous one.

    Attributes
    ----------
    machine : transitions.Machine
        Register callbacks here: ``machines.machine.on_enter_slip(callback)``. With
        ``send_event=True`` a callback receives the event; ``event.model`` is the `Element`.
    elements : list of Element
        The model objects, one per element.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> machines = ElementMachines(model)
    >>> slips = []
    >>> machines.machine.on_enter_slip(lambda event: slips.append(event.model.index))
    >>> trace = simulate(model, Prescribed("0.2"), 3.0, engine=machines)
    >>> slips, machines.elements[0].state
    ([0, 1, 2, 3], 'slip')
    """

    def __init__(
        self,
        model: Model,
        element: type[Element] = Element,
        machine: Callable[..., Machine] = Machine,
    ) -> None:
        if not hasattr(model, "chart"):
            raise ParameterError(
                "it must be a model, for example GMS(parameters, law='signed')",
                place="model",
                value=model,
            )
        chart = model.chart
        self.model = model
        self.guards = {edge: Guard(edge, guard) for edge, guard in chart.guards.items()}
        self.elements = [_new_element(element, model, i) for i in range(model.n)]
        self.machine = _new_machine(
            machine,
            model=self.elements,
            states=[spelled(state.name) for state in chart.states],
            transitions=[
                {
                    "trigger": edge.name,
                    "source": spelled(edge.source),
                    "dest": spelled(edge.target),
                    "conditions": [self.guards[edge.name]],
                }
                for edge in chart.transitions
            ],
            initial=spelled(chart.default_state.name),
            auto_transitions=False,
            send_event=True,
        )

    def table(self, chart: Chart) -> list[list[tuple[int, Guard]]]:
        """Read the edges and guards of each state from the machine, highest priority first.

        Parameters
        ----------
        chart : Chart
            The chart from which the machine was made.

        Returns
        -------
        list of list of (int, Guard)
            Edge index and guard, by state index.

        Raises
        ------
        ChartError
            If the machine has edges or conditions that are not in the chart.
        """
        checked_kind("chart", chart, Chart, "a Chart")
        table: list[list[tuple[int, Guard]]] = []
        for state in chart.states:
            rows = []
            own = {edge.name: index for index, edge in chart.leaving(state.name)}
            for edge in {edge.name: edge for edge in chart.transitions}.values():
                source = spelled(state.name)
                for transition in self.machine.get_transitions(edge.name, source=source):
                    conditions = [c.func for c in transition.conditions]
                    target = spelled(edge.target)
                    if conditions != [self.guards[edge.name]] or transition.dest != target:
                        raise ChartError(
                            f"the machine was given conditions {conditions} or the target "
                            f"{transition.dest!r}, which are not in chart {chart.name!r}",
                            place=f"edge {edge.name!r}",
                            advice="write them in the chart's guard, the only source of switching",
                        )
                    rows.append((own.get(edge.name, -1), self.guards[edge.name]))
            found = [index for index, _ in rows]
            if -1 in found:
                raise ChartError(
                    f"the machine has an edge from {state.name!r} that is not in chart "
                    f"{chart.name!r}",
                    advice="change the chart, the only source of switching",
                )
            for index, edge in chart.leaving(state.name):
                if found.count(index) != 1:
                    raise ChartError(
                        f"the machine has the edge {edge.name!r} {found.count(index)} times, but "
                        f"chart {chart.name!r} has it once",
                        advice="change the chart, the only source of switching",
                    )
            table.append(sorted(rows, key=lambda row: row[0]))
        known = {edge.name for edge in chart.transitions}
        for trigger in self.machine.get_triggers(*self.machine.states):
            if trigger not in known:
                raise ChartError(
                    f"the machine has a trigger {trigger!r} that is not in chart {chart.name!r}",
                    advice="add a Transition to the chart",
                )
        return table


def _new_machine(kind: Callable[..., Machine], **given: Any) -> Machine:
    known = issubclass(kind, Machine) if isinstance(kind, type) else callable(kind)
    made = kind(**given) if known and _takes(kind, given) else None
    if not isinstance(made, Machine):
        raise ParameterError(
            "it must be a class of the package transitions, or make a machine of one",
            place="machine",
            value=kind,
        )
    if inspect.iscoroutinefunction(type(made).dispatch):
        raise ParameterError(
            f"the triggers of an {type(made).__name__} are awaited, and a run cannot wait",
            place="machine",
            advice="take the class without Async",
        )
    if made.model_attribute != "state":
        raise ParameterError(
            f"it keeps the state of an element in {made.model_attribute!r}",
            place="machine",
            advice="leave model_attribute out",
        )
    return made


def _takes(function: Callable[..., Any], given: Mapping[str, Any]) -> bool:
    try:
        inspect.signature(function).bind(**given)
    except (TypeError, ValueError):  # a ValueError for what has no signature
        return False
    return True


def _new_element(kind: type[Element], model: Model, index: int) -> Element:
    if not (isinstance(kind, type) and issubclass(kind, Element)):
        raise ParameterError("it must be a class derived from Element", place="element", value=kind)
    if kind.__eq__ is not object.__eq__:
        raise ParameterError(
            f"{kind.__name__} compares by value, so transitions would treat all elements as "
            "the same",
            advice="use @dataclass(eq=False)",
        )
    element = kind()
    values = vars(element)  # bypasses __setattr__, as an __init__ may have set these names
    values["index"] = index
    values |= parameter_values(model, index)
    values["_fixed"] = frozenset(model.values) | {"index"}
    chart = model.chart
    read = frozenset().union(*map(names_in, chart.guards.values()))
    live = read.union(["t", "x"], chart.inputs, chart.velocities, chart.variables)
    values["_live"] = live - {*values["_fixed"]}
    return element


# --------------------------------------------------------------------------- engines
class Interference(Exception):
    """A callback changed something it may only read; the run turns this into a user's error."""

    def __init__(
        self,
        reason: str,
        place: str = "",
        t: float = 0.0,
        advice: str = "write the switch into the chart, as an edge with a guard",
    ) -> None:
        super().__init__(reason)
        self.reason, self.place, self.t, self.advice = reason, place, t, advice


class MachineEngine:
    """Evaluates and fires the `transitions` machines of all contacts.

    Parameters
    ----------
    parts : sequence of ElementMachines
        One for each contact.
    program : Program
        Of the run.
    mode : list of int
        Active state of each element.
    """

    def __init__(self, parts: Sequence[ElementMachines], program: Program, mode: list[int]) -> None:
        self.program, self.banks = program, program.layout.banks
        self.parts = [part for part in parts for _ in part.elements]  # by machine
        self.elements = [element for part in parts for element in part.elements]
        tables = [
            _numbered(each, bank.first_edge) for each, bank in zip(parts, self.banks, strict=True)
        ]
        self.tables = [
            table for table, part in zip(tables, parts, strict=True) for _ in part.elements
        ]
        self.shown = [0.0] * program.layout.shown.size
        self.values = GuardValues(program.layout)
        # Bypasses __setattr__ of the elements, which would cost time.
        self.seen_by = [vars(element) for element in self.elements]
        self.states = [""] * len(self.elements)
        self.firing = [False]
        for values in self.seen_by:
            values["_firing"] = self.firing
        self.tick, self.jolts = program.ieee["tick"], program.ieee["jolts"]
        self.arrests = {
            bank.first_edge + number
            for part, bank in zip(parts, self.banks, strict=True)
            for number in part.model.chart.arrests
        }
        self.crossing = {*program.surfaces.rise, *program.surfaces.fall}
        self.set_states(mode)

    def restore(self, t: float, y: list[float], mode: Sequence[int]) -> None:
        """Put every element where it was when a run was interrupted."""
        self.set_states(mode)
        self.show(t, y, list(mode), self.program.calm)  # possibly between two firings of a set

    def set_states(self, mode: Sequence[int]) -> None:
        """Put every element into a state, without callbacks."""
        for i, state in enumerate(mode):
            self.set_state(i, self.parts[i].model.chart.states[state].name)

    def set_state(self, machine: int, state: str) -> None:
        """Put one element into a state, without callbacks."""
        element = self.elements[machine]
        self.parts[machine].machine.set_state(spelled(state), element)
        self.states[machine] = spelled(state)
        graphs = getattr(self.parts[machine].machine, "model_graphs", {})
        if id(element) in graphs:  # the state that it shows as active changes only with a firing
            vars(element)["get_graph"](force_new=True)

    def show(self, t: float, y: list[float], mode: list[int], jolt: list[int]) -> None:
        """Show the present values to every element."""
        program = self.program
        program.ieee["values"](t, y, mode, program.p, jolt, self.shown)
        self.values.put(t, y, self.shown, self.seen_by)

    def ask(
        self,
        t: float,
        y: list[float],
        mode: list[int],
        p: Arguments,
        jolt: list[int],
        edges: list[int],
    ) -> None:
        """Fill the first enabled edge of each element, -1 for none, -2 - edge for one refused."""
        del p  # the program has the same values
        self.show(t, y, mode, jolt)
        for i, element in enumerate(self.elements):
            skip = edges[i]  # see `integrators.Switching`
            edges[i] = -1
            for edge, guard in self.tables[i][mode[i]]:
                if edge == skip and edge in self.crossing:
                    continue
                if guard.holds(element):
                    if jolt[i] == JUMPED and edge in self.arrests:
                        edges[i] = -2 - edge if edges[i] == -1 else edges[i]
                        continue
                    edges[i] = edge
                    break

    def act(
        self, edge: int, machine: int, t: float, y: list[float], mode: list[int], p: Arguments
    ) -> None:
        """Take an edge through `transitions`, so that callbacks run."""
        self.trigger(edge, machine, t)
        self.program.ieee["act"](edge, machine, t, y, mode, p)

    def trigger(self, edge: int, machine: int, t: float) -> None:
        """Fire the machine's edge with the values for which its guard was evaluated."""
        bank = self.program.layout.bank(machine)
        row = self.parts[machine].model.chart.transitions[edge - bank.first_edge]
        place = f"{self.called(machine)}, edge {row.name!r}"
        guard = self.parts[machine].guards[row.name]
        guard.held = False  # not what the trigger returns: with a queue that is always True
        # The trigger evaluates the guard once more; assignments follow, as in Stateflow, where the
        # whole set is selected before any of them.
        self.firing[0] = True
        try:
            getattr(self.elements[machine], row.name)()
        except Interference as error:
            raise Interference(error.reason, place, t, error.advice) from None
        except MachineError as error:
            raise Interference(
                f"a callback changed a state ({error.value}); {ONLY_LOOK}", place, t
            ) from error
        finally:
            self.firing[0] = False
        if not guard.held:
            raise Interference(
                "the edge was enabled, but a callback changed the element's values before "
                f"it fired; {ONLY_LOOK}",
                place,
                t,
            )
        self.states[machine] = spelled(row.target)
        for i, (element, state) in enumerate(zip(self.elements, self.states, strict=True)):
            if element.state != state:
                raise Interference(
                    f"a callback put {self.called(i)} into state {shown(element.state)}, "
                    f"but the chart has it in {state!r}; {ONLY_LOOK}",
                    place,
                    t,
                )

    def called(self, machine: int) -> str:
        """Return what an element is called in messages, with its contact if there are several."""
        bank = self.program.layout.bank(machine)
        whose = "" if len(self.banks) == 1 else f"contact {bank.name!r}, "
        return f"{whose}element {machine - bank.first + 1}"


def _numbered(machines: ElementMachines, first: int) -> list[list[tuple[int, Guard]]]:
    """Return the table of a contact with its edges numbered over all contacts."""
    table = machines.table(machines.model.chart)
    return [[(first + edge, guard) for edge, guard in row] for row in table]


ONLY_LOOK = "callbacks may only read"


class IfElse:
    """Evaluates the generated if-else code, the paper's Fig. 2c."""

    def __init__(self, program: Program) -> None:
        self.ask = program.ieee["switch"]
        self.act = program.ieee["act"]
        self.tick, self.jolts = program.ieee["tick"], program.ieee["jolts"]
