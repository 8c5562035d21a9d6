"""Reads a chart from an SCXML document, whose own namespace may keep what SCXML has no word for."""

from __future__ import annotations

import itertools
import re
import warnings
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias
from xml.etree import ElementTree as ET

from gms_fsm.charts.files.imported import Texts, built, number_of
from gms_fsm.charts.files.routes import (
    FlatEdge,
    ImportedEdge,
    ImportedState,
    Route,
    outside,
    spelled,
)
from gms_fsm.charts.files.scxml import OURS, SCXML, STEP, VALUES, assignments, conditions
from gms_fsm.charts.nesting import AGE, is_age
from gms_fsm.charts.parts import DEEPEST_STATE, check_size
from gms_fsm.errors import ChartError, ExpressionError, Part, why
from gms_fsm.foundation.arguments import unknown
from gms_fsm.language import ECMASCRIPT, names_in, parse_value

if TYPE_CHECKING:
    from gms_fsm.charts.chart import Chart

LARGEST = 10_000_000  # bytes: no chart needs as many
AT_TOP = ("datamodel", "state", "final")
IN_STATE = ("onentry", "onexit", "transition", "datamodel", "initial", "history", "state", "final")
WORDS = {
    "&&": " and ", "||": " or ", "!": " not ", "true": "True", "===": "==", "!==": "!=",
    "Math.PI": "pi",
}  # fmt: skip
# Longer signs first: "!=" is left, and refused by the expression language.
TOKEN = re.compile(r"[!=]=+|&&|\|\||!|\bMath\.\w+|\btrue\b")
AssignedTexts: TypeAlias = dict[str, tuple[str, str | None]]  # expression, and the chart's text
DONE = "done.state."  # the event that a state with parts has reached a final one


@dataclass(frozen=True)
class ScxmlTransition:
    """A transition of the document that stands for an edge: with one event, in one state."""

    edge: ImportedEdge
    cond: str | None
    guard: str | None
    assigned: AssignedTexts  # by name: expression, and the chart's text
    order: int | None


def load(kind: type[Chart], path: Path, texts: Mapping[str, Any]) -> Chart:
    """Return the chart of a document."""
    here = str(path)
    given = Texts.of(texts, here)  # unknown names first
    if given.callbacks:
        raise ChartError("a document calls no functions", place=f"{here}: callbacks")
    root = _root(path, here)
    tags = [_tag(each) for each in root.iter()]
    events = [each.get("event") for each in root.iter() if _tag(each) == "transition"]
    states = tags.count("state") + tags.count("final")
    check_size(max(1, states), sum(event != VALUES for event in events), here)
    document = _Document(root, here)
    rows = _ordered(document.rows, here)
    edges = [row.edge for row in rows]
    found = _own_texts(root)
    for part, tag in (("flows", "flow"), ("state_outputs", "force")):
        found[part] = {
            spelled(route): pairs
            for route, each in document.elements.items()
            if (pairs := _pairs(each, tag))
        }
    merged = found | {name: getattr(given, name) for name in texts}
    for part in ("flows", "state_outputs"):
        beside = getattr(given, part)
        if isinstance(beside, Mapping):
            merged[part] = {**found[part], **beside}
    data = _DataModel.of(root, Texts(**merged), document.variables, here)
    merged |= {"variables": data.variables, "let": data.let, "initial": data.initial}
    chart, flat = built(kind, document.states, document.first, edges, Texts(**merged), here)
    _check_kept(chart, rows, flat, document, given)
    if document.logs:
        warnings.warn(
            f"{here}: <log> is left out, because a chart writes nothing: "
            f"{', '.join(dict.fromkeys(document.logs))}",
            stacklevel=4,
        )
    return chart


# --------------------------------------------------------------------------- the document
class _Plain(ET.TreeBuilder):
    """Refuses definitions of entities, which can make a small file huge."""

    def doctype(self, name: str, *_: str | None) -> None:
        """Refuse it."""
        raise ChartError(
            f"it has a document type definition ({name})", advice="leave <!DOCTYPE ...> out"
        )


def _root(path: Path, here: str) -> ET.Element:
    try:
        data = path.read_bytes()[: LARGEST + 1]
        if len(data) > LARGEST:
            raise ChartError(f"it has more than {LARGEST:,} bytes", place=here)
        root = ET.fromstring(data, ET.XMLParser(target=_Plain()))
    except OSError as error:
        raise ChartError(f"it cannot be read: {why(error)}", place=here) from None
    except ChartError as error:  # which is a ValueError, too
        raise error.replaced(place=here) from None
    except (ET.ParseError, LookupError, ValueError) as error:
        raise ChartError(f"it is not XML: {error}", place=here) from None
    if _tag(root) != "scxml":
        raise ChartError(f"its root is <{_tag(root)}>, not <scxml xmlns={SCXML!r}>", place=here)
    return root


def _tag(element: ET.Element) -> str:
    """Return a name of SCXML without its namespace; other ones, and comments, as they are."""
    return str(element.tag).removeprefix(f"{{{SCXML}}}")


def _own(element: ET.Element, name: str) -> str | None:
    return element.get(f"{{{OURS}}}{name}")


def _all(parent: ET.Element, tag: str) -> list[ET.Element]:
    return [each for each in parent if _tag(each) == tag]


def _only(
    parent: Iterable[ET.Element], allowed: tuple[str, ...], place: str
) -> Iterator[ET.Element]:
    """Yield the parts in SCXML's namespace, all of them known."""
    for each in parent:
        tag = _tag(each)
        if tag.startswith("{"):  # of another namespace: not SCXML's
            continue
        if tag not in allowed:
            raise ChartError(
                f"<{tag}> has no counterpart in a chart",
                place=place,
                advice=NO_COUNTERPART.get(tag, "leave it out"),
            )
        yield each


NO_COUNTERPART = {
    "parallel": "write one state for each combination: a chart has one active state",
    "history": "write one state for each that is remembered",
    "script": "write what it computes as let={...}",
    "send": "a timer is read if it is the only way out of a state, or <cancel> stops it there; for "
    "others write the guard 'after(T)'",
    "raise": "write the guard of the edge that waits for it",
    "if": "write an edge for each case",
}


def _plain(text: str) -> str:
    """Return a name of SCXML as a name of a chart."""
    return text.replace(".", "__").replace("-", "_")


class _Document:
    """The states and transitions of a document.

    Parameters
    ----------
    root : Element
        Of the document.
    here : str
        Its file, for messages.
    """

    def __init__(self, root: ET.Element, here: str) -> None:
        self.here, self.logs, self.variables = here, list[str](), set[str]()
        self.routes: dict[str, Route] = {}  # by id
        self.elements: dict[Route, ET.Element] = {}
        self.spelled: set[str] = set()
        if root.get("binding") == "late" and _inner_data(root):
            raise ChartError("binding='late' has no counterpart in a chart", place=here)
        for each in _only(root, AT_TOP, here):
            if _tag(each) != "datamodel":
                self._find(each, (), "")
        if not self.routes:
            raise ChartError("it has no <state>", place=here)
        name = root.get("initial", next(iter(self.routes)))
        self.first = self._route(name, "initial state", here)
        outermost = self.first[:1]
        self.elements = dict(
            sorted(self.elements.items(), key=lambda each: each[0][:1] != outermost)
        )
        self.timers: dict[tuple[Route, str], str] = {}
        self.timed: set[ET.Element] = set()  # <send> and <cancel> that they stand for
        for route, each in self.elements.items():
            self._find_timers(route, each)
        self.kept: dict[Route, dict[str, AssignedTexts]] = {}
        self.states = [self._state(*each) for each in self.elements.items()]
        self.rows = [row for each in self.elements.items() for row in self._rows(*each)]

    def _find(self, element: ET.Element, around: Route, outer: str) -> None:
        """Find a state and those inside of it."""
        name = element.get("id")
        if not name:
            raise ChartError(f"a <{_tag(element)}> has no id", place=self.here)
        local = _own(element, "name") or name.removeprefix(f"{outer}.").removeprefix(f"{outer}__")
        route = (*around, _plain(local))
        if len(route) > DEEPEST_STATE:
            raise ChartError(f"it has states on more than {DEEPEST_STATE} levels", place=self.here)
        if name in self.routes or spelled(route) in self.spelled:
            raise ChartError(
                f"its state {name!r} is there twice, or is spelled {spelled(route)!r} as another",
                place=self.here,
                advice="give each state a name of its own",
            )
        self.routes[name], self.elements[route] = route, element
        self.spelled.add(spelled(route))
        allowed = IN_STATE if _tag(element) == "state" else ("onentry", "onexit")
        for each in _only(element, allowed, f"{self.here}, state {name!r}"):
            if _tag(each) in ("state", "final"):
                self._find(each, route, name)

    def _find_timers(self, route: Route, state: ET.Element) -> None:
        """Find events that a state sends itself after a time, and gets in that state only."""
        edges = [
            each
            for k in range(1, len(route) + 1)
            for each in _all(self.elements[route[:k]], "transition")
        ]
        if any(_tag(each) in ("state", "final") for each in state):
            return
        for send in (each for part in _all(state, "onentry") for each in _all(part, "send")):
            event, name = send.get("event", ""), send.get("id", send.get("event"))
            delay = re.fullmatch(r"([0-9]*\.?[0-9]+)(m?s)", send.get("delay", ""))
            known = {*send.keys()} <= {"event", "delay", "id"} and not len(send)
            if delay is None or not known or (route, event) in self.timers:
                continue
            stops = [
                each
                for part in _all(state, "onexit")
                for each in _all(part, "cancel")
                if each.get("sendid") in (name, event)
            ]
            own = [each for each in _all(state, "transition") if each.get("event") == event]
            others = [each for each in edges if each not in own]
            heard = any(_is_for(event, each) for each in others)
            # If others lead away, it could come after the state has been left and entered again.
            plain = own and not heard and not any(each.get("cond") for each in own)
            if plain and (stops or not others):
                seconds = float(delay[1]) * (0.001 if delay[2] == "ms" else 1.0)
                self.timers[route, event] = f"after({repr(seconds).removesuffix('.0')})"
                self.timed |= {send, *stops}

    def _route(self, name: str, kind: str, place: str) -> Route:
        """Return where a state is."""
        if len(name.split()) > 1:
            raise ChartError(
                f"its {kind}s are {name!r}", place=place, advice="a chart has one active state"
            )
        if name not in self.routes:
            raise unknown(kind, name, self.routes, ChartError, place=place)
        return self.routes[name]

    def _state(self, route: Route, element: ET.Element) -> ImportedState:
        place = f"{self.here}, state {element.get('id')!r}"
        parts = [each for tag in ("state", "final") for each in _all(element, tag)]
        kept = self.kept[route] = {
            tag: self.assigned(_all(element, tag), f"{place}, {tag}")
            for tag in ("onentry", "onexit")
        }
        return ImportedState(
            route,
            place,
            _texts(kept["onentry"]),
            _texts(kept["onexit"]),
            self._first(element, place) if parts else None,
            bool(self._history(element, place)),
        )

    def _history(self, element: ET.Element, place: str) -> str:
        """Return what a history enters at first, if the state has one that enters it."""
        for each in _all(element, "history"):
            inside = _all(each, "transition")
            deep = each.get("type", "shallow") != "shallow"
            if deep or each.get("id") != element.get("initial") or len(inside) != 1:
                raise ChartError(
                    "<history> has no counterpart in a chart, unless it is shallow and the initial "
                    "state of the state around it",
                    place=place,
                    advice=NO_COUNTERPART["history"],
                )
            for _ in _only(inside[0], (), f"{place}, <history>"):
                pass
            return inside[0].get("target", "")
        return ""

    def _first(self, element: ET.Element, place: str) -> Route:
        """Return what is entered inside of a state with parts."""
        name = self._history(element, place) or element.get("initial")
        for initial in _all(element, "initial"):
            for transition in _only(initial, ("transition",), f"{place}, <initial>"):
                name = transition.get("target", "")
                for _ in _only(transition, (), f"{place}, <initial>"):
                    pass
        inside = [each for each in element if _tag(each) in ("state", "final")]
        return self._route(name or str(inside[0].get("id")), "initial state", place)

    def _rows(self, source: Route, state: ET.Element) -> Iterator[ScxmlTransition]:
        """Yield the transitions of a state that are edges."""
        for number, each in enumerate(_all(state, "transition"), start=1):
            place = f"{self.here}, state {state.get('id')!r}, transition"
            if not _brings_values(each):
                events: list[str | None] = [*(each.get("event") or "").split()]
                for event in events or [None]:
                    yield self._row(source, each, event, place, number)

    def _row(
        self, source: Route, element: ET.Element, event: str | None, place: str, number: int
    ) -> ScxmlTransition:
        name = _own(element, "name") or ("" if event in (None, STEP) else str(event))
        name = name.removesuffix(".*").removesuffix(".")
        place = f"{place} {name or number}"
        target = element.get("target")
        to = None if target is None else self._route(target, "target", place)
        at, stays = source, 0 if to is None else outside(source, to)
        if to is not None and element.get("type") == "internal":
            inner = len(to) > len(source) and to[: len(source)] == source
            stays = len(source) if inner else stays
        cond, guard, order = element.get("cond"), _own(element, "guard"), _own(element, "order")
        cond = cond or None  # an empty one is none
        if name.startswith(DONE):
            at, name = self._end(source, name.removeprefix(DONE), cond, place), ""
            event = None
        if name and not re.fullmatch(r"[\w.-]+", name):
            raise ChartError(
                f"its event is {event!r}", place=place, advice="give names of events without *"
            )
        timer = self.timers.get((source, str(event)))
        if cond is None and (event is None or timer is not None):
            cond = ECMASCRIPT.true if timer is None else timer
        assigned = self.assigned([element], place)
        edge = ImportedEdge(
            _plain(name),
            at,
            to,
            place,
            guard if guard is not None else (None if cond is None else _read_back(cond)),
            actions=_texts(assigned),
            stays=stays,
        )
        at_place = int(order) if order is not None and order.isdecimal() else None
        return ScxmlTransition(edge, cond, guard, assigned, at_place)

    def _end(self, source: Route, name: str, cond: str | None, place: str) -> Route:
        """Return the final state that is meant by the event that a state is done."""
        ends = [
            route
            for route, each in self.elements.items()
            if route[:-1] == source and _tag(each) == "final"
        ]
        if self.routes.get(name) != source or len(ends) != 1 or cond is not None:
            raise ChartError(
                f"its event is {DONE + name!r}" + (", and it has a cond" if cond else ""),
                place=place,
                advice="that of the state itself is read, if it has one <final>, without a cond; "
                "for others write an edge from the final state",
            )
        return ends[0]

    def assigned(self, parents: Iterable[ET.Element], place: str) -> AssignedTexts:
        """Return assignments in their order."""
        found: AssignedTexts = {}
        for parent in parents:
            for each in parent:
                if str(each.tag).startswith("{") and _tag(each) == each.tag:
                    raise ChartError(
                        f"<{each.tag}> has no counterpart in a chart",
                        place=place,
                        advice="leave it out",
                    )
            own = (each for each in parent if each not in self.timed)
            for each in _only(own, ("assign", "log"), place):
                if _tag(each) == "log":
                    self.logs.append(place.removeprefix(f"{self.here}, "))
                    continue
                name, expression = each.get("location", ""), each.get("expr")
                if expression is None or name in found:
                    raise ChartError(
                        f"<assign location={name!r}> "
                        + ("has no expr" if expression is None else "is there twice"),
                        place=place,
                        advice="a chart assigns one expression to a variable",
                    )
                found[name] = expression, _own(each, "text")
                self.variables.add(name)
        return found


def _is_for(event: str, transition: ET.Element) -> bool:
    """Return whether a transition waits for an event."""
    waits = [each.removesuffix(".*") for each in (transition.get("event") or "").split()]
    return any(event == each or event.startswith(f"{each}.") for each in waits)


def _inner_data(root: ET.Element) -> bool:
    """Return whether states have data of their own."""
    every = [each for each in root.iter() if _tag(each) == "data"]
    return len(every) > sum(len(_all(each, "data")) for each in _all(root, "datamodel"))


def _brings_values(element: ET.Element) -> bool:
    """Return whether a transition brings values of the host, as an exported document has it."""
    if element.get("event") != VALUES or {"target", "cond"} & {*element.keys()}:
        return False
    return all(each.get("expr") == f"_event.data.{each.get('location')}" for each in element)


# --------------------------------------------------------------------------- edges
def _ordered(rows: list[ScxmlTransition], here: str) -> list[ScxmlTransition]:
    """Return the rows in the chart's own order, if the document keeps it."""
    if any(row.order is None for row in rows):
        return rows
    for before, after in itertools.pairwise(rows):
        if before.edge.source == after.edge.source and before.order >= after.order:  # type: ignore[operator]
            raise ChartError(
                f"{after.edge.trigger!r} stands after {before.edge.trigger!r}, but gms:order says "
                "otherwise",
                place=f"{here}, state {spelled(after.edge.source)!r}",
                advice="if the order of the transitions is right, remove all attributes gms:order",
            )
    return sorted(rows, key=lambda row: row.order or 0)


# --------------------------------------------------------------------------- texts
def _read_back(text: str | None) -> str:
    """Return a condition or an expression of ECMAScript in the language of charts."""
    called = {text.partition("(")[0]: name for name, text in ECMASCRIPT.functions.items()}
    said = TOKEN.sub(lambda found: WORDS.get(found[0], called.get(found[0], found[0])), text or "")
    return " ".join(said.split())


def _texts(assigned: AssignedTexts) -> dict[str, str]:
    """Return the texts of assignments; without those that a chart makes by itself."""
    ours = any(text is not None for _, text in assigned.values())
    return {
        name: _read_back(expression) if text is None else text
        for name, (expression, text) in assigned.items()
        if not (is_age(name) and (ours or expression == "0.0"))
    }


@dataclass(frozen=True)
class _DataModel:
    """What the data of a document are in a chart: variables that start, or named expressions."""

    variables: list[str]
    let: dict[str, str]
    initial: dict[str, float]
    values: dict[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, root: ET.Element, given: Texts, assigned: set[str], here: str) -> _DataModel:
        """Read them; inputs and parameters get their values from the run and the model."""
        parameters = [
            str(each.get("name") if isinstance(each, Mapping) else getattr(each, "name", each))
            for each in given.parameters
        ]
        outside = {*given.inputs, *given.velocities, *parameters, *given.let}
        if root.find(f"{{{OURS}}}chart") is not None:
            ids = (each.get("id", "") for each in root.iter() if _tag(each) == "data")
            outside |= {AGE, *filter(is_age, ids)}  # a chart makes them by itself
        data = cls([*given.variables], {}, {}, dict(given.initial))
        for each in root.iter():
            name = each.get("id", "")
            if _tag(each) != "data" or name in outside:
                continue
            if name in given.initial:
                if name not in data.variables:
                    data.variables.append(name)
                continue
            data.take(each, outside, assigned, f"{here}, <data id={each.get('id')!r}>")
        return cls(data.variables, {**data.let, **given.let}, {**data.initial, **given.initial})

    def take(self, element: ET.Element, outside: set[str], assigned: set[str], place: str) -> None:
        """Take one of the data."""
        name, expression = element.get("id", ""), element.get("expr") or element.text
        if element.get("src") is not None:
            raise ChartError("<data src=...> has no counterpart in a chart", place=place)
        changes = name in assigned or name in self.variables
        if changes and name not in self.variables:
            self.variables.append(name)
        if expression is None or not expression.strip():
            if changes:
                self.values[name] = 0.0
                return
            raise ChartError(
                "it has no expr", place=place, advice="name it in inputs, variables or parameters"
            )
        text = _read_back(expression)
        try:
            tree = parse_value(text, [*outside, *self.values, *self.let])
        except ExpressionError as error:
            raise error.at(Part(place)) from None
        used = names_in(tree)
        if used <= {*self.values}:
            self.values[name] = number_of(tree, self.values)
        elif changes or used & {*self.variables}:
            raise ChartError(
                f"it begins as {text!r}, which is no number",
                place=place,
                advice=f"give its value, initial={{{name!r}: 1.0}}",
            )
        if not changes:
            self.let[name] = repr(self.values[name]) if used & {*self.variables} else text
        elif self.values[name]:
            self.initial[name] = self.values[name]


def _pairs(parent: ET.Element, tag: str) -> dict[str, str]:
    return {
        str(each.get("name")): str(each.get("text", ""))
        for each in parent
        if each.tag == f"{{{OURS}}}{tag}"
    }


def _own_texts(root: ET.Element) -> dict[str, Any]:
    """Return what a document of ours says of the whole chart."""
    own = root.find(f"{{{OURS}}}chart")
    if own is None:
        return {"name": root.get("name") or "imported chart"}
    quantities: dict[str, list[str]] = {"input": [], "velocity": [], "variable": []}
    parameters: list[dict[str, Any]] = []
    for each in own:
        told: dict[str, Any] = dict(each.attrib)
        if each.tag == f"{{{OURS}}}quantity":
            quantities.get(str(told.get("kind")), []).append(str(told.get("name")))
        elif each.tag == f"{{{OURS}}}parameter":
            if "per_element" in told:
                told["per_element"] = told["per_element"] == "true"
            parameters.append(told)
    return {
        "name": own.get("name", ""),
        "reference": own.get("reference", ""),
        "inputs": quantities["input"],
        "velocities": quantities["velocity"],
        "variables": quantities["variable"],
        "parameters": [each["name"] if [*each] == ["name"] else each for each in parameters],
        "let": _pairs(own, "let"),
        "outputs": _pairs(own, "force"),
        "contact_outputs": _pairs(own, "total"),
    }


def _check_kept(
    chart: Chart,
    rows: list[ScxmlTransition],
    flat: list[FlatEdge],
    document: _Document,
    given: Texts,
) -> None:
    """Refuse a document whose conditions are not what the texts kept beside them say."""
    texts = conditions(chart)
    for each in flat:
        row = rows[each.number]
        names, place = {each.name, row.edge.trigger}, row.edge.place
        if row.guard is not None and not names & {*given.guards} and row.cond != texts[each.name]:
            _refuse_changed("cond", row.cond, "gms:guard", texts[each.name], place)
        if not names & {*given.actions}:
            _check_assigned(row.assigned, assignments(chart, "action", each.name), place)
    for kind, tag, beside in (("entry", "onentry", given.entry), ("exit", "onexit", given.exit)):
        for route, kept in document.kept.items():
            name = spelled(route)
            place = f"{document.here}, state {name!r}, {tag}"
            (owner,) = {name, ".".join(route)} & {*chart.nesting.levels} or {""}
            if name not in beside and owner:
                _check_assigned(kept[tag], assignments(chart, kind, owner), place)


def _check_assigned(found: AssignedTexts, meant: Mapping[str, str], place: str) -> None:
    for name, (expression, text) in found.items():
        if text is not None and expression != meant.get(name):
            _refuse_changed(
                f"expr of {name!r}", expression, "gms:text", meant.get(name, "nothing"), place
            )


def _refuse_changed(what: str, now: str | None, beside: str, meant: str, place: str) -> None:
    raise ChartError(
        f"{what} is {now!r}, but {beside} beside it means {meant!r}",
        place=place,
        advice=f"remove {beside} if the document has been changed on purpose, or give the text",
    )
