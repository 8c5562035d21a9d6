"""A friction chart is data: states with flows, edges with guards, all as text.

Machines, pictures, generated if-else code and the relations for event location are all derived
from it. Building a chart checks it but never runs anything.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from gms_fsm.charts.nesting import Nesting, check_ends, check_paths, take_name
from gms_fsm.charts.parameters import QUANTITIES, Parameter, adapted, check_rules
from gms_fsm.charts.parts import (
    SUPPLIED,
    State,
    Transition,
    check_name,
    check_parts,
    event_name,
    parameter_of,
    places_of,
    texts_of,
    tuple_of,
    values_of,
)
from gms_fsm.charts.reader import ChartReader, called
from gms_fsm.errors import ChartError, cut, shown
from gms_fsm.foundation.arguments import checked_kind, checked_path, refusing
from gms_fsm.foundation.display import displayed
from gms_fsm.foundation.equality import by_value
from gms_fsm.language import MATLAB_LIKE, Condition, Value, spell
from gms_fsm.language.normal import renamed_in

if TYPE_CHECKING:
    from gms_fsm.charts.files.imported import GivenTexts

__all__ = ["Chart", "State", "Transition"]


@refusing(ChartError, instead={"edges": "transitions"})
@displayed("svg", "html")
@by_value()
@dataclass(frozen=True, init=False, eq=False)
class Chart:
    """The state chart of one friction element, checked at construction.

    Parameters
    ----------
    name : str
        What the chart is called in pictures and messages.
    inputs : sequence of str
        Names supplied from outside the element; models supply ``t`` [s], ``x`` [m], ``v`` [m/s] and
        ``s``, the element's threshold. A contact binds further ones.
    variables : sequence of str
        The element's own continuous states, for example ``("z",)``.
    parameters : sequence of Parameter or str
        Constants, each with a unit and a rule; a plain name stands for a parameter of unknown unit
        that may be any finite number.
    states : sequence of State
        The first one is the default state. Of states inside others the chart has the innermost,
        called by their paths: ``slip.forward``.
    transitions : sequence of Transition
        Among the edges that leave one state, earlier ones have priority, but those of inner states
        precede those of the states around them. Guards may read ``F``, the force of the contact,
        ``a``, its acceleration, ``age``, the time since the state that the edge leaves was entered,
        s, and ``after(T)``, short for ``age >= T``; on an edge to itself ``every(T)`` is the same.
        ``duration(abs(v) < v_c)`` is how long a condition has held there without a break, s.
    outputs : mapping of str to str
        ``F``, the element's force [N], in all states that give none of their own; may use
        ``d<variable>`` for a derivative.
    reference : str, optional
        Where the equations are published.
    let : mapping of str to str, optional
        Named expressions that all other texts can use; later ones can use earlier ones.
    velocities : sequence of str
        What the contact moves by. With several (a planar contact) the forces are ``F``,
        ``F_<second>`` and so on, the accelerations ``a``, ``a_<second>``. With none it is the chart
        of a `Supervisor`, whose outputs have any names.
    contact_outputs : mapping of str to str, optional
        The force of a contact, where it is not just the sum of its elements' forces, which is
        called ``F`` here: ``{"F": "F + sigma_2 * v"}``.
    initial : mapping of str to float, optional
        Values with which variables start, where a run gives none; 0 for the others.
    layout : mapping of str to (float, float), optional
        Where pictures show the centre of each state: points to the right and down. Charts that
        differ in nothing else are equal.

    Raises
    ------
    ChartError
        If states, edges, flows and names are inconsistent.
    ExpressionError
        If a text cannot be parsed; the message gives the text, the column and what is allowed.

    Examples
    --------
    >>> plastic = Chart("sticky", inputs=("v",), variables=("z",), parameters=("k",),
    ...                 states=(State("stick", flow={"z": "v"}),), transitions=(),
    ...                 outputs={"F": "k * z"})
    >>> plastic.default_state.name
    'stick'
    """

    name: str
    inputs: tuple[str, ...]
    variables: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    states: tuple[State, ...]
    transitions: tuple[Transition, ...]
    outputs: Mapping[str, str]
    reference: str = ""
    let: Mapping[str, str] = field(default_factory=dict)
    velocities: tuple[str, ...] = ("v",)
    contact_outputs: Mapping[str, str] = field(default_factory=dict)
    initial: Mapping[str, float] = field(default_factory=dict)
    layout: Mapping[str, tuple[float, float]] = field(default_factory=dict, compare=False)
    guards: Mapping[str, Condition] = field(init=False, repr=False, compare=False)
    flows: Mapping[tuple[str, str], Value] = field(init=False, repr=False, compare=False)
    assignments: Mapping[tuple[str, str], Mapping[str, Value]] = field(
        init=False, repr=False, compare=False
    )
    # By state and force; None where the state is locked.
    forces: Mapping[tuple[str, str], Value | None] = field(init=False, repr=False, compare=False)
    lets: Mapping[str, Value] = field(init=False, repr=False, compare=False)
    # Variables that no text declares: times in states, and histories.
    hidden: tuple[str, ...] = field(init=False, repr=False, compare=False)
    # How long conditions have held: of each hidden variable that is such a time its condition.
    durations: Mapping[str, Condition] = field(init=False, repr=False, compare=False)
    # As written; `states` and `transitions` are the innermost states and the edges between them.
    nesting: Nesting = field(init=False, repr=False)
    totals: Mapping[str, Value] = field(init=False, repr=False, compare=False)
    # How its quantities are measured where a system uses it; nothing is computed from that.
    rotary: bool = field(default=False, init=False, repr=False, compare=False)
    units: tuple[tuple[str, str], ...] = field(default=(), init=False, repr=False, compare=False)

    def __init__(
        self,
        name: str,
        inputs: Iterable[str] = ("v",),
        variables: Iterable[str] = (),
        parameters: Iterable[Parameter | str] = (),
        states: Iterable[State] = (),
        transitions: Iterable[Transition] = (),
        outputs: Mapping[str, str] | None = None,
        reference: str = "",
        *,
        let: Mapping[str, str] | None = None,
        velocities: Iterable[str] = ("v",),
        contact_outputs: Mapping[str, str] | None = None,
        initial: Mapping[str, float] | None = None,
        layout: Mapping[str, Sequence[float]] | None = None,
    ) -> None:
        here = f"chart {name!r}"
        given: dict[str, object] = {"name": name, "reference": reference}
        for each, parts in (
            ("inputs", inputs),
            ("variables", variables),
            ("states", states),
            ("transitions", transitions),
            ("velocities", velocities),
        ):
            given[each] = tuple_of(parts, f"{here}: {each}")
        constants = tuple_of(parameters, f"{here}: parameters")
        given["parameters"] = tuple(parameter_of(each, here) for each in constants)
        for each, texts in (
            ("outputs", outputs),
            ("let", let),
            ("contact_outputs", contact_outputs),
        ):
            given[each] = texts_of({} if texts is None else texts, f"{here}: {each}")
        for each, value in given.items():  # copies: nobody else can change a frozen chart
            object.__setattr__(self, each, value)
        object.__setattr__(self, "nesting", Nesting(self.states, self.transitions))
        self._check_names()
        check_rules(self.parameters, here)
        object.__setattr__(self, "states", self.nesting.leaves())
        object.__setattr__(self, "initial", values_of(initial or {}, self.variables, here))
        object.__setattr__(self, "layout", places_of(layout or {}, self.states, here))
        object.__setattr__(self, "transitions", self.nesting.rows())
        for each, value in ChartReader(self).trees().items():
            object.__setattr__(self, each, value)

    def __repr__(self) -> str:
        states, edges = len(self.states), len(self.transitions)
        counts = f"{states} state{'s' * (states != 1)}, {edges} edge{'s' * (edges != 1)}"
        return f"<Chart {cut(self.name)!r}: {counts}>"

    def _check_names(self) -> None:
        here = f"chart {self.name!r}"
        for text in ("name", "reference"):
            if not isinstance(getattr(self, text), str):
                raise ChartError(
                    "it must be a text", place=f"{here}: {text}", value=getattr(self, text)
                )
        check_parts(self.states, self.transitions, here)
        groups = (
            ("input", "inputs", dict.fromkeys([*self.inputs, *self.velocities])),
            ("variable", "variables", self.variables),
            ("derivative", "variables", ["d" + variable for variable in self.variables]),
            ("parameter", "parameters", self.parameter_names),
            ("let", "let", self.let),
            ("state", "states", [s.name for s in self.states]),
            ("edge", "transitions", [t.name for t in self.transitions]),
        )
        owner: dict[str, str] = {}
        for kind, attribute, names in groups:
            for i, name in enumerate(names):
                key: tuple[str | int, ...] = (attribute, name) if kind == "let" else (attribute, i)
                key = (*key, "name") if kind in ("state", "edge", "parameter") else key
                check_name(name, kind, here, key)
                if name in SUPPLIED and kind != "input" and (name, kind) != ("s", "let"):
                    raise ChartError(
                        f"{kind} name {name!r} is taken",
                        place=here,
                        advice="t, x, v and s can only be inputs",
                        key=key,
                    )
                take_name(name, owner, kind, here, key)
        for level in self.nesting.levels.values():
            check_name(level.state.name, "state", here, (*level.key, "name"))
        check_paths(self.nesting, owner, here)
        for name in sorted({*self.force_names} & owner.keys()):
            raise ChartError(f"{owner[name]} name {name!r} is taken by a force", place=here)
        check_ends(self.nesting, owner, here)

    @property
    def force_names(self) -> tuple[str, ...]:
        """What it gives out: ``F``, then ``F_<velocity>``; without velocity its outputs."""
        if not self.velocities:
            levels = self.nesting.levels.values()
            own = [name for level in levels for name in level.state.outputs]
            return tuple(dict.fromkeys([*self.outputs, *own]))
        return ("F", *(f"F_{each}" for each in self.velocities[1:]))

    @property
    def events(self) -> tuple[str, ...]:
        """The events that edges wait for or emit, as trees call them."""
        used = (name for edge in self.transitions for name in (edge.event, *edge.emit))
        return tuple(dict.fromkeys(event_name(name) for name in used if name))

    @property
    def rate_names(self) -> tuple[str, ...]:
        """Name of the acceleration along each velocity: ``a``, then ``a_<velocity>``."""
        return ("a", *(f"a_{each}" for each in self.velocities[1:]))[: len(self.velocities)]

    @property
    def locks(self) -> bool:
        """Whether there is a state that locks the contact."""
        return any(state.locked for state in self.states)

    @property
    def arrests(self) -> tuple[int, ...]:
        """Numbers of the edges that lock the contact where its velocity passes 0."""
        locked = {state.name for state in self.states if state.locked}
        return tuple(
            number
            for number, edge in enumerate(self.transitions)
            if edge.target in locked and edge.source not in locked and not edge.impulse
        )

    @property
    def sets_velocity(self) -> bool:
        """Whether an assignment sets a velocity of the contact."""
        return any({*self.velocities} & {*steps} for steps in self.assignments.values())

    @classmethod
    def load(cls, path: str | Path) -> Chart:
        """Read a chart from a TOML file.

        Parameters
        ----------
        path : str or Path
            With the keys ``name``, ``reference``, ``inputs``, ``velocities``, ``variables``,
            ``parameters`` (a list of names) or ``[[parameter]]`` (name, unit, rule, per_element,
            meaning, assumed), ``[let]``, ``[outputs]``, ``[contact_outputs]``, ``[initial]``,
            ``[[state]]`` (name, flow, entry, exit, outputs, locked, initial, history; those inside
            one as ``[[state.state]]``) and ``[[edge]]`` (name, from, to, guard, do, impulse).

        Returns
        -------
        Chart
            Checked, as any chart.

        Raises
        ------
        ChartError, ExpressionError
            If the file is no chart; the message names file, line, key and text.

        Examples
        --------
        >>> import tempfile
        >>> from gms_fsm.charts import LUGRE
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     Chart.load(LUGRE.save(f"{folder}/lugre.toml")) == LUGRE
        True
        """
        from gms_fsm.charts.files.tables import load

        return load(checked_path("path", path), cls)

    @classmethod
    def from_transitions(cls, machine: Any, **texts: Unpack[GivenTexts]) -> Chart:
        """Build a chart from a machine of the package transitions, and texts given beside it.

        The machine gives states, edges and their priority: the order of the triggers and of their
        transitions, those of inner states first. Texts name an inner state ``outer__inner``. An
        edge has the name of its trigger, or ``source_target`` if the trigger has edges that differ.

        Parameters
        ----------
        machine : transitions.Machine
            Of any class but the asynchronous ones.
        **texts
            ``inputs``, ``variables``, ``parameters``, ``outputs``, ``name``, ``reference``,
            ``let``, ``velocities``, ``contact_outputs`` and ``initial`` as for `Chart`; a parameter
            may be a mapping of the fields of `Parameter`. ``callbacks`` says what the functions of
            the machine do, by their names: a condition as a text, what others assign as a mapping,
            empty for those that only look on. By the name of an edge or of a trigger: ``guards``,
            which stand for conditions without a text, and ``actions``. By the name of a state, with
            or without states inside: ``flows``, ``entry``, ``exit`` and ``state_outputs``.
            ``locked`` names the states that lock the contact, ``impulses`` the edges that take an
            impulse to do so.

        Returns
        -------
        Chart
            Checked, as any chart.

        Raises
        ------
        ChartError, ExpressionError
            If the machine has something without counterpart in a chart, which is named, such as a
            function without a text, or parallel states; or if a text is wrong.

        Examples
        --------
        >>> from transitions import Machine
        >>> edges = [["slips", "stick", "slip"], ["sticks", "slip", "stick"]]
        >>> machine = Machine(states=["stick", "slip"], initial="stick", transitions=edges)
        >>> chart = Chart.from_transitions(machine, name="a spring that slips", variables=("z",),
        ...     parameters=("k", "z_s"), outputs={"F": "k * z"}, flows={"stick": {"z": "v"}},
        ...     guards={"slips": "abs(z) >= z_s", "sticks": "z * v < 0"})
        >>> chart.guard_text("slips")
        '|z| >= z_s'
        """
        from gms_fsm.charts.files import from_transitions, imported

        given = imported.Texts.of(texts, from_transitions.HERE)
        read = from_transitions.read(machine, given.callbacks)
        return imported.built(cls, *read, given, from_transitions.HERE)[0]

    @classmethod
    def from_scxml(cls, path: str | Path, **texts: Unpack[GivenTexts]) -> Chart:
        """Build a chart from an SCXML document, and texts given beside it.

        The document gives the states, the transitions in their order, what is assigned, and data:
        a variable with its value at the start, or a named expression if nothing assigns it. What
        the export ``scxml`` keeps there in a namespace of its own need not be given. ``<log>`` is
        left out, with a warning.

        Parameters
        ----------
        path : str or Path
            The document. Names are as for `from_transitions`, from the events of the transitions;
            a dot in a name becomes ``__``, a hyphen ``_``.
        **texts
            As for `from_transitions`; they replace what the document says. Guards that are not
            given are read from ``cond``, if that is written as in Python or ECMAScript. A guard
            that is given for an event with several edges is joined to their own.

        Returns
        -------
        Chart
            Checked, as any chart.

        Raises
        ------
        ChartError, ExpressionError
            If the document cannot be read, or has something without counterpart in a chart, which
            is named, such as a parallel state, a deep history, a script; or if a text is wrong.

        Examples
        --------
        >>> import tempfile
        >>> from gms_fsm import export
        >>> from gms_fsm.charts import GMS_ELEMENT
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     _ = export(GMS_ELEMENT["signed"], "scxml", folder, name="gms")
        ...     Chart.from_scxml(f"{folder}/gms.scxml") == GMS_ELEMENT["signed"]
        True
        """
        from gms_fsm.charts.files import from_scxml

        return from_scxml.load(cls, checked_path("path", path), texts)

    def save(self, path: str | Path) -> Path:
        """Write the chart to a TOML file, from which `load` returns an equal one.

        Parameters
        ----------
        path : str or Path
            File name ending in ``.toml``.

        Returns
        -------
        Path
            The file written.

        Raises
        ------
        OutputError
            If it cannot be written, has another ending, or exists and is not as gms-fsm wrote it.
        """
        from gms_fsm.charts.files.tables import save

        return save(self, checked_path("path", path))

    def placed(self, layout: Mapping[str, Sequence[float]]) -> Chart:
        """Return the same chart with another layout; `plots.layout` has one to begin with.

        Parameters
        ----------
        layout : mapping of str to (float, float)
            As for `Chart`; without any, pictures find places themselves.

        Returns
        -------
        Chart
            An equal chart; `save` writes its layout, too.

        Raises
        ------
        ChartError
            If a state is missing or unknown, or a place is not two finite numbers.

        Examples
        --------
        >>> from gms_fsm.charts import GMS_ELEMENT
        >>> chart = GMS_ELEMENT["signed"].placed({"stick": (0, 0), "slip": (300, 150)})
        >>> chart.layout["slip"], chart == GMS_ELEMENT["signed"]
        ((300.0, 150.0), True)
        """
        other = copy(self)
        object.__setattr__(other, "layout", places_of(layout, self.states, f"chart {self.name!r}"))
        return other

    # ------------------------------------------------------------------ queries
    @property
    def length(self) -> str:
        """Unit of its position: m, or rad where it turns; v has that per second."""
        return "rad" if self.rotary else "m"

    @property
    def force(self) -> str:
        """Unit of its force: N, or Nm where it turns."""
        return "Nm" if self.rotary else "N"

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the constants, in order."""
        return tuple(each.name for each in self.parameters)

    @property
    def declared(self) -> Mapping[str, Parameter]:
        """Parameters for its known names: inputs, parameters and the variable z."""
        own = {each.name: each for each in self.parameters}
        shared = self.inputs + self.variables
        known = {name: each for name, each in QUANTITIES.items() if name in shared} | own
        return {name: adapted(each, self) for name, each in known.items()}

    def unit(self, name: str) -> str:
        """Return the unit of an input, a variable or a parameter.

        Parameters
        ----------
        name : str
            A variable called z is a deflection [m], or an angle where the chart turns.

        Returns
        -------
        str
            Empty if unknown.

        Examples
        --------
        >>> from gms_fsm.charts import LUGRE
        >>> LUGRE.unit("sigma_0"), LUGRE.unit("v"), LUGRE.unit("w")
        ('N/m', 'm/s', '')
        """
        found = self.declared.get(checked_kind("name", name, str, "a text"))
        return "" if found is None else found.unit

    @property
    def default_state(self) -> State:
        """The initial state of an element unless another is given."""
        return self.states[0]

    def state_index(self, name: str) -> int:
        """Return the position of a state.

        Parameters
        ----------
        name : str
            A state's name; a composite state stands for the one that is entered with it.

        Returns
        -------
        int
            Its index in `states`.

        Raises
        ------
        ChartError
            If there is no such state.
        """
        if not isinstance(name, str) or name not in self.nesting.levels:
            raise ChartError(
                f"chart {self.name!r} has no state {shown(name)}",
                advice=f"its states are {_listed(self.nesting.levels)}",
            )
        return [s.name for s in self.states].index(self.nesting.ways(name)[0][1])

    def assigned(self, edge: Transition | None = None) -> tuple[tuple[str, Value], ...]:
        """Return what an edge assigns, in order: exits, action, entries.

        Parameters
        ----------
        edge : Transition, optional
            One of `transitions`; without one, the start of a run, which enters the default state.

        Returns
        -------
        tuple of (str, Value)
            Variables and velocities, each with its new value.
        """
        given = checked_kind("edge", edge, (Transition, type(None)), "a Transition of the chart")
        performed = self.nesting.begins() if given is None else given.performs
        return tuple(each for key in performed for each in self.assignments[key].items())

    def leaving(self, state: str) -> tuple[tuple[int, Transition], ...]:
        """Return the edges that leave a state, each with its index, highest priority first.

        Parameters
        ----------
        state : str
            A state's name.

        Returns
        -------
        tuple of (int, Transition)
            Index in `transitions`, and the edge.
        """
        return tuple((i, t) for i, t in enumerate(self.transitions) if t.source == state)

    def guard_text(self, edge: str) -> str:
        """Return a guard as a chart shows it.

        Parameters
        ----------
        edge : str
            An edge's name.

        Returns
        -------
        str
            For example ``"|v| <= v_c && |z| < s"``.
        """
        if not isinstance(edge, str) or edge not in self.guards:
            raise ChartError(
                f"chart {self.name!r} has no edge {shown(edge)}",
                advice=f"its edges are {', '.join(map(repr, self.guards)) or 'none'}",
            )
        return spell(renamed_in(self.guards[edge], called(self.durations)), MATLAB_LIKE)


def _listed(names: Iterable[str]) -> str:
    return ", ".join(repr(n) for n in names) or "none"
