"""A friction chart is data: states with flows, edges with guards, all as text.

Machines, pictures, generated if-else code and the relations for event location are all derived
from it. Building a chart checks it but never runs anything.
"""

from __future__ import annotations

import keyword
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from gms_fsm._arguments import checked_kind
from gms_fsm.charts.parameters import QUANTITIES, Parameter
from gms_fsm.errors import ChartError, ExpressionError, shown
from gms_fsm.language import (
    CONSTANTS,
    FUNCTIONS,
    MATLAB_LIKE,
    Condition,
    Value,
    parse_condition,
    parse_value,
    spell,
)

__all__ = ["Chart", "State", "Transition"]

SUPPLIED = ("t", "x", "v", "s")  # inputs that a model supplies to its chart
# Names that the generated code and the element objects use themselves.
RESERVED = frozenset(
    {"F", "S", "dy", "edge", "held", "i", "index", "machine", "mode", "n", "out", "own", "p"}
    | {"shared", "source", "state", "states", "tables", "target", "trigger", "watch", "weight"}
    | {"y", "pow"}
    | set(CONSTANTS)
    | set(FUNCTIONS)
)


@dataclass(frozen=True)
class State:
    """One state of an element: how its variables evolve while it is active.

    Parameters
    ----------
    name : str
        For example ``"stick"``.
    flow : mapping of str to str
        For each variable, the text of its time derivative, for example ``{"z": "v"}``.
    entry, exit : mapping of str to str, optional
        Assignments ``variable: expression`` performed when the state is entered or left.

    Examples
    --------
    >>> State("stick", flow={"z": "v"}).name
    'stick'
    """

    name: str
    flow: Mapping[str, str]
    entry: Mapping[str, str] = field(default_factory=dict)
    exit: Mapping[str, str] = field(default_factory=dict)

    def __new__(cls, *parts: Any, **given: Any) -> State:
        """Refuse unknown arguments with an error of this package."""
        for name in sorted(given.keys() - {each.name for each in fields(cls)}):
            raise ChartError(
                f"a State takes name, flow, entry and exit, not {name!r}",
                place=f"state {shown(given.get('name', parts[0] if parts else '?'))}",
                advice="states do not nest, so write one state for each combination",
            )
        return object.__new__(cls)

    def __post_init__(self) -> None:
        for each in ("flow", "entry", "exit"):  # copies: nobody else can change a frozen chart
            texts = _texts(getattr(self, each), f"state {shown(self.name)}: {each}")
            object.__setattr__(self, each, texts)


@dataclass(frozen=True)
class Transition:
    """One guarded edge between two states.

    Parameters
    ----------
    name : str
        The edge's name, unique in its chart, for example ``"arrest"``.
    source, target : str
        State names.
    guard : str
        The condition under which the edge is taken.
    actions : mapping of str to str, optional
        Assignments ``variable: expression`` performed when it is taken.

    Examples
    --------
    >>> Transition("arrest", "slip", "stick", guard="abs(v) <= v_c and abs(z) < s").target
    'stick'
    """

    name: str
    source: str
    target: str
    guard: str
    actions: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        texts = _texts(self.actions, f"edge {shown(self.name)}: actions")
        object.__setattr__(self, "actions", texts)


@dataclass(frozen=True)
class Chart:
    """The state chart of one friction element, checked at construction.

    Parameters
    ----------
    name : str
        What the chart is called in pictures and messages.
    inputs : sequence of str
        Names supplied from outside the element; models supply ``t`` [s], ``x`` [m], ``v`` [m/s] and
        ``s``, the element's threshold.
    variables : sequence of str
        The element's own continuous states, for example ``("z",)``.
    parameters : sequence of Parameter or str
        Constants, each with a unit and a rule; a plain name stands for a parameter of unknown unit
        that may be any finite number.
    states : sequence of State
        The first one is the default state.
    transitions : sequence of Transition
        Among the edges that leave one state, earlier ones have priority.
    outputs : mapping of str to str
        Must define ``F``, the element's force [N]; may use ``d<variable>`` for a derivative.
    reference : str, optional
        Where the equations are published.

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
    guards: Mapping[str, Condition] = field(init=False, repr=False, compare=False)
    flows: Mapping[tuple[str, str], Value] = field(init=False, repr=False, compare=False)
    assignments: Mapping[tuple[str, str], Mapping[str, Value]] = field(
        init=False, repr=False, compare=False
    )
    forces: Mapping[str, Value] = field(init=False, repr=False, compare=False)

    def __init__(
        self,
        name: str,
        inputs: Iterable[str],
        variables: Iterable[str],
        parameters: Iterable[Parameter | str],
        states: Iterable[State],
        transitions: Iterable[Transition],
        outputs: Mapping[str, str],
        reference: str = "",
    ) -> None:
        here = f"chart {name!r}"
        given: dict[str, object] = {"name": name, "reference": reference}
        for each, parts in (
            ("inputs", inputs),
            ("variables", variables),
            ("states", states),
            ("transitions", transitions),
        ):
            given[each] = _tuple(parts, f"{here}: {each}")
        constants = _tuple(parameters, f"{here}: parameters")
        given["parameters"] = tuple(_parameter(each, here) for each in constants)
        given["outputs"] = _texts(outputs, f"{here}: outputs")
        for each, value in given.items():  # copies: nobody else can change a frozen chart
            object.__setattr__(self, each, value)
        self._check_names()
        self._check_rules()
        self._read()

    def _read(self) -> None:
        """Parse the texts into trees."""
        here, symbols = f"chart {self.name!r}", self._symbols
        guards, flows, assignments = {}, {}, {}
        for state in self.states:
            owner = f"{here}, state {state.name!r}"
            for variable in self.variables:
                if variable not in state.flow:
                    raise ChartError(
                        f"no flow for {variable!r}",
                        place=owner,
                        advice=f"give one, for example flow={{{variable!r}: '0'}}",
                    )
                flows[state.name, variable] = _value(
                    state.flow[variable], symbols, f"{owner}, flow of {variable!r}"
                )
            self._only_variables(state.flow, f"{owner}, flow")
            for kind, texts in (("entry", state.entry), ("exit", state.exit)):
                assignments[kind, state.name] = self._assignments(texts, f"{owner}, {kind}")
        for edge in self.transitions:
            owner = f"{here}, edge {edge.name!r}"
            try:
                guards[edge.name] = parse_condition(edge.guard, symbols)
            except ExpressionError as error:
                raise error.at(f"{owner}, guard") from None
            assignments["action", edge.name] = self._assignments(edge.actions, f"{owner}, action")
        derivatives = tuple("d" + variable for variable in self.variables)
        if set(self.outputs) != {"F"}:
            raise ChartError(
                f"outputs has {_listed(self.outputs)}",
                place=here,
                advice="it must give exactly 'F', the force",
            )
        if hasattr(self.outputs["F"], "keys"):
            raise ChartError(
                f"output 'F' is {shown(self.outputs['F'])}",
                place=here,
                advice="it is one text for all states. Where the law differs by state, let a "
                "variable carry it, for example a variable f with the flow 'k * v' in "
                "one state and an entry {'f': 'F_c * sgn(v)'} in another",
            )
        forces = {
            name: _value(text, symbols + derivatives, f"{here}, output {name!r}")
            for name, text in self.outputs.items()
        }
        object.__setattr__(self, "guards", guards)
        object.__setattr__(self, "flows", flows)
        object.__setattr__(self, "assignments", assignments)
        object.__setattr__(self, "forces", forces)

    # ------------------------------------------------------------------ checks
    def _check_names(self) -> None:
        here = f"chart {self.name!r}"
        for each, wanted, example in (
            ("states", State, "State('stick', flow={'z': 'v'})"),
            ("transitions", Transition, "Transition('slips', 'stick', 'slip', guard='z > s')"),
        ):
            for given in getattr(self, each):
                if not isinstance(given, wanted):
                    raise ChartError(
                        f"{each} has {shown(given)}", place=here, advice=f"write it as {example}"
                    )
        if not self.states:
            raise ChartError("it has no states", place=here, advice="give at least one")
        if not self.variables:
            raise ChartError(
                "it has no variables", place=here, advice="give at least one, for example ('z',)"
            )
        derivatives = ["d" + variable for variable in self.variables]
        groups = (
            ("input", self.inputs),
            ("variable", self.variables),
            ("derivative", derivatives),
            ("parameter", self.parameter_names),
            ("state", [s.name for s in self.states]),
            ("edge", [t.name for t in self.transitions]),
        )
        owner: dict[str, str] = {}
        for kind, names in groups:
            for name in names:
                _check_name(name, kind, here)
                if name in SUPPLIED and kind != "input":
                    raise ChartError(
                        f"{kind} name {name!r} is taken",
                        place=here,
                        advice="t, x, v and s can only be inputs",
                    )
                if name in owner:
                    raise ChartError(
                        f"the name {name!r} is used twice ({owner[name]} and {kind})",
                        place=here,
                        advice="every name must be unique",
                    )
                owner[name] = kind
        known = [s.name for s in self.states]
        for edge in self.transitions:
            for end, state in (("source", edge.source), ("target", edge.target)):
                if state not in known:
                    raise ChartError(
                        f"{end} {state!r} is not a state",
                        place=f"{here}, edge {edge.name!r}",
                        advice=f"states: {_listed(known)}",
                    )

    def _check_rules(self) -> None:
        for each in self.parameters:
            known = {*self.parameter_names} - {each.name}
            for name in sorted(each.others - known):
                raise ChartError(
                    f"chart {self.name!r}, parameter {each.name!r}: its rule names {name!r}, "
                    "which is not another parameter",
                    advice=f"there are {_listed(sorted(known))}",
                )

    def _only_variables(self, texts: Mapping[str, str], owner: str) -> None:
        for name in texts:
            if name not in self.variables:
                raise ChartError(
                    f"{name!r} is not a variable",
                    place=owner,
                    advice=f"variables: {_listed(self.variables)}",
                )

    def _assignments(self, texts: Mapping[str, str], owner: str) -> dict[str, Value]:
        self._only_variables(texts, owner)
        return {
            name: _value(text, self._symbols, f"{owner} {name!r}") for name, text in texts.items()
        }

    @property
    def _symbols(self) -> tuple[str, ...]:
        """The names its texts may use."""
        return self.inputs + self.variables + self.parameter_names

    # ------------------------------------------------------------------ queries
    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the constants, in order."""
        return tuple(each.name for each in self.parameters)

    @property
    def declared(self) -> Mapping[str, Parameter]:
        """Parameters for its known names: inputs, parameters and the variable z."""
        own = {each.name: each for each in self.parameters}
        shared = self.inputs + self.variables
        return {name: each for name, each in QUANTITIES.items() if name in shared} | own

    def unit(self, name: str) -> str:
        """Return the unit of an input, a variable or a parameter.

        Parameters
        ----------
        name : str
            A variable called z is a deflection [m].

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
            A state's name.

        Returns
        -------
        int
            Its index in `states`.

        Raises
        ------
        ChartError
            If there is no such state.
        """
        names = [s.name for s in self.states]
        if name not in names:
            raise ChartError(
                f"chart {self.name!r} has no state {shown(name)}",
                advice=f"its states are {_listed(names)}",
            )
        return names.index(name)

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
        return spell(self.guards[edge], MATLAB_LIKE)


def _tuple(given: Any, owner: str) -> tuple[Any, ...]:
    """Return a copy of a sequence, which is no single thing."""
    if isinstance(given, str | State | Transition | Parameter):
        text = shown(given) if isinstance(given, str) else f"{type(given).__name__}(...)"
        raise ChartError(
            f"{owner} is {text}, not a tuple", advice=f"write it with a comma: ({text},)"
        )
    if not isinstance(given, Iterable):
        raise ChartError("give a tuple", place=owner, value=given)
    return tuple(given)


def _parameter(given: object, here: str) -> Parameter:
    """Return a parameter; a plain name has no unit, and no rule but to be finite."""
    if isinstance(given, Parameter):
        return given
    if isinstance(given, str):
        return Parameter(given)
    raise ChartError(
        f"parameters has {shown(given)}",
        place=here,
        advice="write it as 'k', or as Parameter('k', 'N/m', '> 0') with its unit and rule",
    )


def _texts(given: object, owner: str) -> dict[str, str]:
    """Return a copy of a mapping of names to texts."""
    if not isinstance(given, Mapping):
        raise ChartError(
            "it gives a text for each name, for example {'z': 'v'}", place=owner, value=given
        )
    return dict(given)


def _check_name(name: str, kind: str, here: str) -> None:
    if not isinstance(name, str) or not name.isidentifier() or keyword.iskeyword(name):
        raise ChartError(
            f"{kind} name {name!r} is not a name",
            place=here,
            advice="use letters, digits and _, not starting with a digit, and no Python keyword",
        )
    if unicodedata.normalize("NFKC", name) != name:
        raise ChartError(f"{kind} name {name!r} is not in Unicode normal form NFKC", place=here)
    if name in RESERVED or name.startswith(("_", "on_", "is_", "may_", "to_")):
        raise ChartError(
            f"{kind} name {name!r} is reserved",
            place=here,
            advice=f"not available are {_listed(sorted(RESERVED))}, and names that start "
            "with _, on_, is_, may_ or to_",
        )


def _value(text: str, symbols: Iterable[str], owner: str) -> Value:
    try:
        return parse_value(text, symbols)
    except ExpressionError as error:
        raise error.at(owner) from None


def _listed(names: Iterable[str]) -> str:
    return ", ".join(repr(n) for n in names) or "none"
