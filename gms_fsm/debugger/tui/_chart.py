"""A chart drawn in text: boxes with edges below them, and one lane per target state at the right.

An edge leaves its source downwards and joins the lane of its target; where it only crosses
another lane, the lines form a cross. The active state has a heavy frame and the word ACTIVE; the
edge just taken is a heavy line with the word FIRED, if there is room for it.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from itertools import groupby

from gms_fsm.debugger._view import EdgeView, StateView
from gms_fsm.debugger.tui._spans import Line, Span

MARKS = {True: "✓", False: "✗", None: "?"}
LIGHT, HEAVY = 1, 2
# The box-drawing character for weights 0, 1, 2 of the arms up, right, down and left: base 3.
ARMS = " ╴╸╷┐┑╻┒┓╶─╾┌┬┭┎┰┱╺╼━┍┮┯┏┲┳╵┘┙│┤┥╽┧┪└┴┵├┼┽┟╁╅┕┶┷┝┾┿┢╆╈╹┚┛╿┦┩┃┨┫┖┸┹┞╀╃┠╂╉┗┺┻┡╄╇┣╊╋"
ROUND = dict(zip("┌┐└┘", "╭╮╰╯", strict=True))
UP, RIGHT, DOWN, LEFT = range(4)
BOX, STUB, LABEL = 2, 4, 6  # columns of a box, of its edges' stem, and of their texts
LANE = 2  # columns of a lane
JOINED = "\N{NO-BREAK SPACE}"  # a guard is wrapped between its clauses, if they fit
NARROWEST = 12  # columns for the text of a guard, before the drawing becomes wider than asked


class Canvas:
    """Characters by row and column: lines with weights, texts, and the role of each."""

    def __init__(self) -> None:
        self.arms: dict[tuple[int, int], list[int]] = {}
        self.texts: dict[tuple[int, int], str] = {}
        self.roles: dict[tuple[int, int], str] = {}

    def arm(self, row: int, column: int, side: int, weight: int, role: str) -> None:
        """Draw from the middle of a cell to one side; the heaviest line stays."""
        arms = self.arms.setdefault((row, column), [0, 0, 0, 0])
        if weight >= max(arms):
            self.roles[row, column] = role
        arms[side] = max(arms[side], weight)

    def across(self, row: int, left: int, right: int, weight: int, role: str) -> None:
        """Draw a horizontal line between the middles of two cells."""
        for column in range(left, right):
            self.arm(row, column, RIGHT, weight, role)
            self.arm(row, column + 1, LEFT, weight, role)

    def down(self, column: int, top: int, bottom: int, weight: int, role: str) -> None:
        """Draw a vertical line between the middles of two cells."""
        for row in range(top, bottom):
            self.arm(row, column, DOWN, weight, role)
            self.arm(row + 1, column, UP, weight, role)

    def write(self, row: int, column: int, text: str, role: str) -> None:
        """Write a text over whatever is there."""
        for i, character in enumerate(text, start=column):
            self.texts[row, i], self.roles[row, i] = character, role

    def lines(self) -> list[Line]:
        """Return all rows; neighbours with the same role are one span."""
        cells = {place: _drawn(arms) for place, arms in self.arms.items()} | self.texts
        found: list[Line] = []
        for row in range(1 + max(row for row, _ in cells)):
            end = 1 + max((column for r, column in cells if r == row), default=-1)
            each = [(cells.get((row, c), " "), self.roles.get((row, c), "")) for c in range(end)]
            found.append(
                [
                    Span("".join(text for text, _ in group), role)
                    for role, group in groupby(each, lambda cell: cell[1])
                ]
            )
        return found


def _drawn(arms: Sequence[int]) -> str:
    up, right, low, left = arms
    character = ARMS[27 * up + 9 * right + 3 * low + left]
    return ROUND.get(character, character)


def chart_art(states: Sequence[StateView], width: int, *, names: bool = True) -> list[Line]:
    """Draw a chart."""
    targets = [s.name for s in states if any(e.target == s.name for t in states for e in t.edges)]
    room = max(NARROWEST, width - LABEL - LANE * len(targets) - 1)
    texts = {state.name: [_texts(edge, room, names) for edge in state.edges] for state in states}
    contents = [_content(state, max(NARROWEST, width - BOX - 4 - LANE)) for state in states]
    inner = max(len(text) for content in contents for text in content)
    longest = [len(text) for found in texts.values() for lines in found for text in lines]
    first = max(BOX + inner + 6, LABEL + max(longest, default=0) + 2)
    lanes = {name: first + LANE * i for i, name in enumerate(targets)}
    canvas, row = Canvas(), 0
    entries: dict[str, int] = {}
    leaving: list[tuple[int, EdgeView]] = []
    for number, (state, content) in enumerate(zip(states, contents, strict=True)):
        entries[state.name] = row + 1
        bottom = _box(canvas, row, content, inner, active=state.active, default=number == 0)
        row = bottom + 1
        for edge, lines in zip(state.edges, texts[state.name], strict=True):
            leaving.append((row, edge))
            canvas.down(STUB, bottom, row, LIGHT, "dim")
            bottom = row
            for i, text in enumerate(lines):
                canvas.write(row + i, LABEL, text, _role(edge))
            if lines:
                canvas.write(row, LABEL + len(lines[0]), " ", "")
            row += len(lines)
    for at, edge in sorted(leaving, key=lambda each: each[1].fired):
        start = LABEL + len(_texts(edge, room, names)[0]) + 1
        _wire(canvas, edge, (at, start), lanes[edge.target], entries[edge.target])
    for name in targets:
        came = any(edge.fired and edge.target == name for _, edge in leaving)
        weight, role = (HEAVY, "fired") if came else (LIGHT, "dim")
        canvas.across(entries[name], BOX + inner + 4, lanes[name], weight, role)
        canvas.write(entries[name], BOX + inner + 4, "◀", role)
    return canvas.lines()


def _wire(canvas: Canvas, edge: EdgeView, begin: tuple[int, int], lane: int, entry: int) -> None:
    """Draw an edge from its text to the lane of its target, and along the lane."""
    weight, role = (HEAVY, "fired") if edge.fired else (LIGHT, "dim")
    row, column = begin
    canvas.across(row, column, lane, weight, role)
    canvas.down(lane, min(row, entry), max(row, entry), weight, role)
    canvas.across(row, STUB, STUB + 1, weight, role)


def _box(
    canvas: Canvas, row: int, content: Sequence[str], inner: int, *, active: bool, default: bool
) -> int:
    """Draw a state and return the row of its lower border."""
    weight, role = (HEAVY, "active") if active else (LIGHT, "")
    left, right, bottom = BOX, BOX + inner + 3, row + len(content) + 1
    for each in (row, bottom):
        canvas.across(each, left, right, weight, role)
    for each in (left, right):
        canvas.down(each, row, bottom, weight, role)
    for number, text in enumerate(content, start=row + 1):
        canvas.write(number, left + 2, text, role or ("head" if number == row + 1 else ""))
    if default:
        canvas.write(row + 1, 0, "●▶", "dim")
    return bottom


def _content(state: StateView, room: int) -> list[str]:
    lines = [state.name + ("  ◉ ACTIVE" if state.active else "")]
    lines += [f"d{name} = {text}" for name, text in state.flow]
    lines += [f"{name} = {text}" for name, text in state.forces]
    lines += ["locked: v = 0"] * state.locked
    return [part for each in lines for part in textwrap.wrap(each, room, subsequent_indent="  ")]


def _texts(edge: EdgeView, room: int, names: bool) -> list[str]:
    """Return the priority, the name and the guard of an edge, with one mark per clause."""
    marks = "".join(MARKS[truth] for truth in edge.clauses)
    name = f" {edge.name}" if names else ""
    guard = " ".join(each.replace(" ", JOINED) for each in re.split(r" (?=&& |\|\| )", edge.guard))
    text = f"[{guard}]{f'{JOINED}{marks}' if marks else ''}"
    # Without room for the word, the heavy line alone says that the edge has fired.
    words = (" FIRED", "") if edge.fired else ("",)
    leads = (f"{edge.priority}{name}{word} {text}" for word in words)
    found = min((textwrap.wrap(each, room, subsequent_indent="  ") for each in leads), key=len)
    return [each.replace(JOINED, " ") for each in found]


def _role(edge: EdgeView) -> str:
    """Return the role of an edge's text: taken, about to be taken, evaluated, or not evaluated."""
    if edge.fired:
        return "fired"
    return "" if edge.clauses else "dim"
