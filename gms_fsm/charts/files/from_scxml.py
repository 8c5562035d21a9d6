"""Reads a chart from an SCXML document, whose own namespace may keep what SCXML has no word for."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

from gms_fsm.charts.files.imported import ImportedEdge, Texts, built
from gms_fsm.charts.files.scxml import OURS, SCXML, STEP, VALUES, assignments, conditions
from gms_fsm.charts.parts import check_size
from gms_fsm.errors import ChartError, why
from gms_fsm.foundation.arguments import unknown
from gms_fsm.language import ECMASCRIPT

if TYPE_CHECKING:
    from gms_fsm.charts.chart import Chart

LARGEST = 10_000_000  # bytes: no chart needs as many
AT_TOP = ("datamodel", "state")
IN_STATE = ("onentry", "onexit", "transition")
WORDS = {"&&": " and ", "||": " or ", "!": " not ", "true": "True"}
# Longer signs first: "!=" is left, and refused by the expression language.
TOKEN = re.compile(r"[!=]=+|&&|\|\||!|\bMath\.\w+|\btrue\b")


@dataclass(frozen=True)
class ScxmlTransition:
    """A transition of the document that stands for an edge, in one state."""

    name: str
    source: str
    target: str
    cond: str | None
    guard: str | None
    assigned: dict[str, tuple[str, str | None]]  # by name: expression, and the chart's text
    order: int | None
    place: str


def load(kind: type[Chart], path: Path, texts: Mapping[str, Any]) -> Chart:
    """Return the chart of a document."""
    here = str(path)
    given = Texts.of(texts, here)  # unknown names first
    root = _root(path, here)
    states = _states(root, here)
    events = [one.get("event") for state in states for one in _all(state, "transition")]
    check_size(len(states), sum(event != VALUES for event in events), here)
    rows = [row for state in states for row in _rows(state, here)]
    rows = _named(_ordered(rows, here))
    edges = _edges(rows)
    found = _own_texts(root)
    found["guards"] = {
        row.name: row.guard if row.guard is not None else _read_back(row.cond)
        for row in rows
        if row.cond is not None or row.guard is not None
    }
    found["actions"] = {row.name: _texts(row.assigned) for row in rows}
    for part, tag in (("entry", "onentry"), ("exit", "onexit")):
        found[part] = {
            str(state.get("id")): _texts(_assigned(_all(state, tag), here)) for state in states
        }
    found["flows"] = {str(each.get("id")): _pairs(each, "flow") for each in states}
    found["state_outputs"] = {str(each.get("id")): _pairs(each, "force") for each in states}
    merged = {**found, **texts}
    for part in ("guards", "actions", "entry", "exit", "flows", "state_outputs"):
        beside = getattr(given, part)
        if isinstance(beside, Mapping):
            merged[part] = {**found[part], **beside}
    chart = built(kind, [str(each.get("id")) for each in states], edges, Texts(**merged), here)
    _check_kept(chart, rows, states, given, here)
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


def _only(parent: ET.Element, allowed: tuple[str, ...], place: str) -> Iterator[ET.Element]:
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


FLAT = "write one state for each combination: a chart has one active state"
NO_COUNTERPART = {
    "parallel": FLAT,
    "state": FLAT,
    "initial": FLAT,
    "history": FLAT,
    "final": "friction does not end: leave it out",
    "script": "write what it computes as let={...}",
    "send": "write an edge with the guard 'after(T)' for a timer",
    "if": "write an edge for each case",
}


def _states(root: ET.Element, here: str) -> list[ET.Element]:
    """Return the states, the default state first."""
    states = []
    for each in _only(root, AT_TOP, here):
        if _tag(each) == "datamodel":
            for data in each:
                if data.get("src") is not None:
                    raise ChartError("<data src=...> has no counterpart in a chart", place=here)
            continue
        if not each.get("id"):
            raise ChartError("a <state> has no id", place=here)
        for _ in _only(each, IN_STATE, f"{here}, state {each.get('id')!r}"):
            pass
        states.append(each)
    ids = [str(each.get("id")) for each in states]
    first = root.get("initial", ids[0] if ids else "")
    if first not in ids:
        raise unknown("initial state", first, ids, ChartError, place=here)
    return sorted(states, key=lambda each: each.get("id") != first)


def _rows(state: ET.Element, here: str) -> Iterator[ScxmlTransition]:
    """Yield the transitions of a state that are edges."""
    source = str(state.get("id"))
    for number, each in enumerate(_all(state, "transition"), start=1):
        event, target = each.get("event"), each.get("target")
        if event == VALUES and target is None and each.get("cond") is None:
            continue  # brings values of the host
        name = _own(each, "name") or ("" if event in (None, STEP) else str(event))
        place = f"{here}, state {source!r}, transition {name or number}"
        if target is None or each.get("type") == "internal":
            raise ChartError(
                "a transition without target, or internal, has no counterpart in a chart",
                place=place,
                advice="give the state itself as target",
            )
        if len(target.split()) != 1:
            raise ChartError(
                f"its targets are {target!r}", place=place, advice="a chart has one active state"
            )
        if event is not None and not re.fullmatch(r"\w+", event):
            raise ChartError(
                f"its event is {event!r}", place=place, advice="give one name without * and dots"
            )
        cond = each.get("cond")
        if cond is None and event is None:
            cond = ECMASCRIPT.true
        order = _own(each, "order")
        yield ScxmlTransition(
            name,
            source,
            target,
            cond,
            _own(each, "guard"),
            _assigned([each], place),
            int(order) if order is not None and order.isdecimal() else None,
            place,
        )


def _assigned(parents: list[ET.Element], place: str) -> dict[str, tuple[str, str | None]]:
    """Return assignments in their order."""
    found: dict[str, tuple[str, str | None]] = {}
    for parent in parents:
        for each in _only(parent, ("assign",), place):
            name, expression = each.get("location", ""), each.get("expr")
            if expression is None or name in found:
                raise ChartError(
                    f"<assign location={name!r}> "
                    + ("has no expr" if expression is None else "is there twice"),
                    place=place,
                    advice="a chart assigns one expression to a variable",
                )
            found[name] = expression, _own(each, "text")
    return found


# --------------------------------------------------------------------------- edges
def _ordered(rows: list[ScxmlTransition], here: str) -> list[ScxmlTransition]:
    """Return the rows in the chart's own order, if the document keeps it."""
    if any(row.order is None for row in rows):
        return rows
    for before, after in itertools.pairwise(rows):
        if before.source == after.source and before.order >= after.order:  # type: ignore[operator]
            raise ChartError(
                f"{after.name!r} stands after {before.name!r}, but gms:order says otherwise",
                place=f"{here}, state {after.source!r}",
                advice="if the order of the transitions is right, remove all attributes gms:order",
            )
    return sorted(rows, key=lambda row: row.order or 0)


def _named(rows: list[ScxmlTransition]) -> list[ScxmlTransition]:
    """Give every row the name of its edge; rows of one edge differ in their source only."""
    kinds: dict[str, set[tuple[str, str | None, str]]] = {}
    for row in rows:
        kind = (row.target, row.cond, repr(row.assigned))
        kinds.setdefault(row.name, set()).add(kind)
    used: dict[str, int] = {}
    named = []
    for row in rows:
        name = row.name
        if not name or len(kinds[name]) > 1:
            made = f"{row.source}_{row.target}"
            used[made] = used.get(made, 0) + 1
            name = made if used[made] == 1 else f"{made}_{used[made]}"
        named.append(ScxmlTransition(**{**vars(row), "name": name}))
    return named


def _edges(rows: list[ScxmlTransition]) -> list[ImportedEdge]:
    found: dict[str, ImportedEdge] = {}
    for row in rows:
        sources = (*found[row.name].sources, row.source) if row.name in found else (row.source,)
        found[row.name] = ImportedEdge(row.name, sources, row.target, row.place)
    return [*found.values()]


# --------------------------------------------------------------------------- texts
def _read_back(text: str | None) -> str:
    """Return a condition or an expression of ECMAScript in the language of charts."""
    called = {text.partition("(")[0]: name for name, text in ECMASCRIPT.functions.items()}
    said = TOKEN.sub(lambda found: WORDS.get(found[0], called.get(found[0], found[0])), text or "")
    return " ".join(said.split())


def _texts(assigned: Mapping[str, tuple[str, str | None]]) -> dict[str, str]:
    """Return the texts of assignments; without those that a chart makes by itself."""
    ours = any(text is not None for _, text in assigned.values())
    return {
        name: _read_back(expression) if text is None else text
        for name, (expression, text) in assigned.items()
        if not (name == "age" and (ours or expression == "0.0"))
    }


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
    chart: Chart, rows: list[ScxmlTransition], states: list[ET.Element], given: Texts, here: str
) -> None:
    """Refuse a document whose conditions are not what the texts kept beside them say."""
    texts = conditions(chart)
    for row in rows:
        if row.guard is not None and row.name not in given.guards and row.cond != texts[row.name]:
            _refuse_changed("cond", row.cond, "gms:guard", texts[row.name], row.place)
        if row.name not in given.actions:
            _check_assigned(row.assigned, assignments(chart, "action", row.name), row.place)
    for kind, tag, beside in (("entry", "onentry", given.entry), ("exit", "onexit", given.exit)):
        for state in states:
            name = str(state.get("id"))
            place = f"{here}, state {name!r}, {tag}"
            if name not in beside:
                found = _assigned(_all(state, tag), place)
                _check_assigned(found, assignments(chart, kind, name), place)


def _check_assigned(
    found: Mapping[str, tuple[str, str | None]], meant: Mapping[str, str], place: str
) -> None:
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
