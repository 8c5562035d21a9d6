"""The parts of a chart: states and transitions, as the user writes them."""

from __future__ import annotations

import keyword
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from math import isfinite, nan
from typing import Any

from gms_fsm.charts.parameters import Parameter, checked_scalar
from gms_fsm.errors import ChartError, ParameterError, shown
from gms_fsm.foundation.arguments import refusing, unknown
from gms_fsm.foundation.equality import by_value
from gms_fsm.language import CONSTANTS, EVENT, FUNCTIONS, YIELDING

DEEPEST_STATE = 8  # levels; deeper ones nobody could read
MOST_PARTS = 5_000  # states and edges of a chart; more would take minutes to read and to compile
NO_GUARD = "an event alone"  # what stands for a guard that is left out


SUPPLIED = ("t", "x", "v", "s")  # inputs that a model supplies to its chart
# Names of the language and of the element objects; generated code gives way to a chart's names.
RESERVED = frozenset(
    {"F", "age", "after", "index", "machine", "pow", "state", "states", "trigger"}
    | set(CONSTANTS)
    | set(FUNCTIONS) - set(YIELDING)
)


def check_name(name: str, kind: str, here: str, key: tuple[str | int, ...]) -> None:
    """Refuse what cannot be the name of a part of a chart."""
    if not isinstance(name, str) or not name.isidentifier() or keyword.iskeyword(name):
        raise ChartError(
            f"{kind} name {name!r} is not a name",
            place=here,
            advice="use letters, digits and _, not starting with a digit, and no Python keyword",
            key=key,
        )
    if unicodedata.normalize("NFKC", name) != name:
        raise ChartError(
            f"{kind} name {name!r} is not in Unicode normal form NFKC", place=here, key=key
        )
    if name in RESERVED or name.startswith(("_", "on_", "is_", "may_", "to_")):
        raise ChartError(
            f"{kind} name {name!r} is reserved",
            place=here,
            advice=f"not available are {', '.join(map(repr, sorted(RESERVED)))}, and names that "
            "start with _, on_, is_, may_ or to_",
            key=key,
        )


def check_size(states: int, edges: int, place: str) -> None:
    """Refuse a chart without states, and one that is too large, before anything else of it."""
    if not states:
        raise ChartError("it has no states", place=place, advice="give at least one")
    if states + edges > MOST_PARTS:
        raise ChartError(
            f"it has {states:,} states and {edges:,} edges",
            place=place,
            advice=f"a chart can have {MOST_PARTS:,} of both together",
        )


@refusing(
    ChartError,
    instead={"during": "flow", "on_enter": "entry", "on_exit": "exit"},
)
@by_value()
@dataclass(frozen=True, eq=False)
class State:
    """One state of a machine: how its variables evolve, and what force it gives, while active.

    A state with `states` of its own is composite: one of them is active while it is.

    Parameters
    ----------
    name : str
        For example ``"stick"``.
    flow : mapping of str to str, optional
        For each variable, the text of its time derivative, for example ``{"z": "v"}``. A variable
        that is left out does not change.
    entry, exit : mapping of str to str, optional
        Assignments ``variable: expression`` performed when the state is entered or left. The entry
        of the default state is performed at the start of a run.
    outputs : mapping of str to str, optional
        Forces in this state, in place of the chart's.
    locked : bool
        While the state is active, the velocities of the contact are held at 0, and its forces are
        those that hold them.
    states : sequence of State, optional
        The states inside. They inherit `flow`, `outputs` and `locked`, unless they give their own.
    initial : str, optional
        The state inside that is entered with this one; the first one unless another is named.
    history : bool
        Whether the state inside that was active last is entered again.

    Examples
    --------
    >>> State("stick", flow={"z": "v"}).name
    'stick'
    >>> State("forward", outputs={"F": "F_c + b * v"}).outputs["F"]
    'F_c + b * v'
    >>> State("slip", states=(State("forward"), State("backward"))).initial
    'forward'
    """

    name: str
    flow: Mapping[str, str] = field(default_factory=dict)
    entry: Mapping[str, str] = field(default_factory=dict)
    exit: Mapping[str, str] = field(default_factory=dict)
    outputs: Mapping[str, str] = field(default_factory=dict)
    locked: bool = False
    states: tuple[State, ...] = ()
    initial: str = ""
    history: bool = False

    def __post_init__(self) -> None:
        here = f"state {shown(self.name)}"
        for each in ("flow", "entry", "exit", "outputs"):
            # Copies: nobody else can change a frozen chart.
            given = getattr(self, each)
            if isinstance(given, State):
                raise ChartError(
                    f"{each} is a state",
                    place=here,
                    advice=f"those inside are states=(State({given.name!r}, ...), ...)",
                )
            object.__setattr__(self, each, texts_of(given, f"{here}: {each}"))
        for each in ("locked", "history"):
            given = getattr(self, each)
            if not isinstance(given, bool):
                raise ChartError("it must be True or False", place=f"{here}: {each}", value=given)
        object.__setattr__(self, "states", tuple_of(self.states, f"{here}: states"))
        self._check_inside(here)
        if self.states and not self.initial:
            object.__setattr__(self, "initial", self.states[0].name)

    def _check_inside(self, here: str) -> None:
        for i, each in enumerate(self.states):
            if not isinstance(each, State):
                raise ChartError(
                    f"states has {shown(each)}",
                    place=here,
                    advice="write it as State('forward', outputs={'F': 'F_c'})",
                    key=("states", i),
                )
        names = [each.name for each in self.states]
        for i, name in enumerate(names):
            if name in names[:i]:
                raise ChartError(
                    f"the name {name!r} is used twice in it",
                    place=here,
                    advice="every name must be unique",
                    key=("states", i, "name"),
                )
        if self.initial and self.initial not in names:
            raise ChartError(
                f"initial {shown(self.initial)} is not a state inside it",
                place=here,
                advice=f"states inside: {', '.join(map(repr, names)) or 'none'}",
                key=("initial",),
            )
        if self.history and not self.states:
            raise ChartError(
                "it has a history, and no states inside",
                place=here,
                advice="give its states, or leave history out",
                key=("history",),
            )
        if self.depth > DEEPEST_STATE:
            raise ChartError(
                f"it has states on more than {DEEPEST_STATE} levels", place=here, key=("states",)
            )

    @property
    def depth(self) -> int:
        """Number of levels of states, itself included."""
        return 1 + max((each.depth for each in self.states), default=0)


@refusing(
    ChartError,
    instead={"trigger": "name", "dest": "target", "conditions": "guard", "condition": "guard"},
    guard="guard='True' for always",
)
@by_value()
@dataclass(frozen=True, init=False, eq=False)
class Transition:
    """One guarded edge between two states.

    Parameters
    ----------
    name : str
        The edge's name, unique in its chart, for example ``"arrest"``.
    source : str or sequence of str
        The state it leaves, or several that it leaves alike; from a composite state it leaves
        whichever state inside is active. A state inside another is named with it, ``slip.forward``.
    target : str
        The state it enters.
    guard : str
        The condition under which the edge is taken; ``"True"`` for always.
    actions : mapping of str to str, optional
        Assignments ``variable: expression`` performed when it is taken. An assignment to a velocity
        is an impulse that keeps the momentum of the bodies.
    event : str
        The event that the edge waits for; its guard then has to hold at that instant, and may be
        left out.
    emit : sequence of str
        Events for the machines of the system; they are asked for them next, at the same instant.
    impulse : bool
        Whether an edge into a locked state takes the velocity that is left as an impulse, on
        purpose: an engaging clutch, a rest speed. Other edges lock the contact where its velocity
        passes 0, and are not taken at an instant in which it jumps.

    Examples
    --------
    >>> Transition("arrest", "slip", "stick", guard="abs(v) <= v_c and abs(z) < s").target
    'stick'
    """

    name: str
    source: str
    target: str
    guard: str
    actions: Mapping[str, str]
    impulse: bool = field(repr=False)
    event: str = field(repr=False)
    emit: tuple[str, ...] = field(repr=False)
    sources: tuple[str, ...] = field(init=False, repr=False)
    # Whose assignments are performed, in this order: ("exit", "stick"), ("action", "slips") ...
    performs: tuple[tuple[str, str], ...] = field(init=False, repr=False, compare=False)

    def __init__(
        self,
        name: str,
        source: str | Sequence[str],
        target: str,
        guard: str = NO_GUARD,
        actions: Mapping[str, str] | None = None,
        *,
        event: str = "",
        emit: str | Sequence[str] = (),
        impulse: bool = False,
    ) -> None:
        here = f"edge {shown(name)}"
        emitted = (emit,) if isinstance(emit, str) else tuple_of(emit, f"{here}: emit")
        for each in (*emitted, *[event][: bool(event)]):
            if not isinstance(each, str) or not each.isidentifier():
                raise ChartError("it is not a name", place=f"{here}: event", value=each)
        if guard == NO_GUARD and not event:
            raise ChartError("it has no guard", place=here, advice="give one; 'True' is always")
        guard = "True" if guard == NO_GUARD else guard
        if not isinstance(source, str) and not isinstance(source, Sequence):
            raise ChartError(
                "it must be the name of a state, or several",
                place=f"edge {shown(name)}: source",
                value=source,
            )
        sources = (source,) if isinstance(source, str) else tuple(source)
        if not sources:
            raise ChartError(
                "it leaves no state", place=f"edge {shown(name)}", advice="name the state it leaves"
            )
        given = texts_of({} if actions is None else actions, f"edge {shown(name)}: actions")
        if not isinstance(impulse, bool):
            raise ChartError(
                "it must be True or False", place=f"edge {shown(name)}: impulse", value=impulse
            )
        for each, value in (
            ("name", name),
            ("source", sources[0]),
            ("target", target),
            ("guard", guard),
            ("actions", given),
            ("impulse", impulse),
            ("event", event),
            ("emit", emitted),
            ("sources", sources),
            ("performs", ()),
        ):
            object.__setattr__(self, each, value)

    def leaving(self, source: str) -> Transition:
        """Return the transition that leaves one of its sources, and knows all of them."""
        one = copy(self)
        object.__setattr__(one, "source", source)
        return one


def event_name(event: str) -> str:
    """Return what an event is called in trees, where it is 1 while machines are asked for it."""
    return EVENT + event


def check_parts(states: Sequence[object], transitions: Sequence[object], here: str) -> None:
    """Refuse what is no state or no transition, and too many of them."""
    for each, given, wanted, example in (
        ("states", states, State, "State('stick', flow={'z': 'v'})"),
        (
            "transitions",
            transitions,
            Transition,
            "Transition('slips', 'stick', 'slip', guard='z > s')",
        ),
    ):
        for part in given:
            if not isinstance(part, wanted):
                raise ChartError(
                    f"{each} has {shown(part)}", place=here, advice=f"write it as {example}"
                )
    edges = [each for each in transitions if isinstance(each, Transition)]
    check_size(len(states), sum(len(each.sources) for each in edges), here)


def texts_of(given: object, owner: str) -> dict[str, str]:
    """Return a copy of a mapping of names to texts."""
    if not isinstance(given, Mapping):
        example = "{'F': 'k * z'}" if owner.endswith("outputs") else "{'z': 'v'}"
        if owner.endswith("outputs") and isinstance(given, str) and "'" not in given:
            example = f"{{'F': {shown(given)}}}"
        raise ChartError(
            f"it gives a text for each name, for example {example}", place=owner, value=given
        )
    return dict(given)


def tuple_of(given: Any, owner: str) -> tuple[Any, ...]:
    """Return a copy of a sequence, which is no single thing."""
    if isinstance(given, str | State | Transition | Parameter):
        text = shown(given) if isinstance(given, str) else f"{type(given).__name__}(...)"
        raise ChartError(
            f"{owner} is {text}, not a tuple", advice=f"write it with a comma: ({text},)"
        )
    if not isinstance(given, Iterable):
        raise ChartError("give a tuple", place=owner, value=given)
    return tuple(given)


def parameter_of(given: object, here: str) -> Parameter:
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


def values_of(given: object, variables: Sequence[str], here: str) -> dict[str, float]:
    """Return the values with which variables start."""
    owner = f"{here}: initial"
    if not isinstance(given, Mapping):
        raise ChartError(
            "it gives a value for a variable, like {'z': 1.0}", place=owner, value=given
        )
    for name in given:
        if name not in variables:
            raise unknown("variable", name, variables, ChartError, place=owner)
    try:
        return {
            name: checked_scalar(f"{owner}, {name!r}", value, "finite")
            for name, value in given.items()
        }
    except ParameterError as error:
        raise ChartError(error.reason, place=error.place, value=error.value) from None


def places_of(given: object, parts: Sequence[State], here: str) -> dict[str, tuple[float, float]]:
    """Return the places of all states, or none."""
    states, owner = [state.name for state in parts], f"{here}: layout"
    example = {name: [150 * i, 0] for i, name in enumerate(states[:2])}
    if not isinstance(given, Mapping):
        raise ChartError(
            f"it gives a place for each state, like {example}", place=owner, value=given
        )
    for name in given:
        if name not in states:
            raise unknown("state", name, states, ChartError, place=owner, key=("layout", name))
    missing = [name for name in states if name not in given] if given else []
    if missing:
        raise ChartError(
            f"it has no place for {', '.join(missing)}",
            place=owner,
            advice="give a place for each state, or for none",
            key=("layout",),
        )
    return {name: _place(given[name], f"{owner}, {name!r}", name) for name in states if given}


def _place(given: object, owner: str, name: str) -> tuple[float, float]:
    try:
        x, y = (float(each) for each in given)  # type: ignore[attr-defined]  # may fail
    except (TypeError, ValueError):
        x = y = nan
    if not (isfinite(x) and isfinite(y)):
        raise ChartError(
            "a place is two finite numbers, points to the right and down",
            place=owner,
            value=given,
            key=("layout", name),
        )
    return x, y
