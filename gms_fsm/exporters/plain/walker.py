"""The one walker over statements; a language is a row of forms, and a dialect of expressions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from gms_fsm.exporters.plain.form import (
    ByState,
    Declare,
    Enter,
    ForEach,
    Guards,
    Keep,
    Recall,
    SetTo,
    Statement,
    TwoWays,
    Verbatim,
)
from gms_fsm.foundation.text import visible
from gms_fsm.language import Dialect, Node, spell


@dataclass(frozen=True)
class Forms:
    """How a language writes statements; ``{0}`` and ``{1}`` are their parts.

    Parameters
    ----------
    assign, new, load : str
        An assignment; one that declares its name, which is then not changed; one from memory.
    declare : str
        A declaration of names; empty if names are declared elsewhere.
    first, then, other, end : str
        Choices: ``if``, ``else if``, ``else``, and the end.
    loop, end_loop : str
        Over the elements: ``{0}`` is the index and ``{1}`` the number of elements.
    comment : str
        At the end of a line.
    marks : mapping of str to str
        What may not stand in a comment, and what is written instead.
    nothing : str
        A statement that does nothing, where there must be one.
    """

    assign: str
    new: str
    load: str
    declare: str
    first: str
    then: str
    other: str
    end: str
    loop: str
    end_loop: str
    comment: str
    marks: Mapping[str, str]
    nothing: str = ""

    def clean(self, text: str) -> str:
        """Return a text that may stand in a comment."""
        text = visible(text)
        for mark, instead in self.marks.items():
            text = text.replace(mark, instead)
        return text

    def note(self, text: str) -> str:
        """Return a comment at the end of a line; nothing for no text."""
        return "  " + self.comment.format(self.clean(text)) if text else ""


@dataclass(frozen=True)
class Walker:
    """Writes the statements of one friction.

    Parameters
    ----------
    forms : Forms
        Of statements.
    dialect : Dialect
        Of expressions.
    texts : mapping of str to str
        What names are called where their own name is not written.
    states : sequence of str
        Names of the states, for comments.
    test, enter : callable
        Take the number of a state: the test of being in it, and the statement that enters it.
    count : int
        Number of elements.
    index : str
        What loops over the elements count with; empty if there is no loop.
    memory : mapping of str to str
        Where variables are kept, if that is not where they are read.
    """

    forms: Forms
    dialect: Dialect
    texts: Mapping[str, str]
    states: Sequence[str]
    test: Callable[[int], str]
    enter: Callable[[int], str]
    count: int
    index: str
    memory: Mapping[str, str] = field(default_factory=dict)

    def spell(self, tree: Node) -> str:
        """Return an expression."""
        return spell(tree, self.dialect, self.texts)

    def lines(self, statements: Iterable[Statement]) -> list[str]:
        """Return the lines of statements."""
        return [line for each in statements for line in self._statement(each)]

    def _statement(self, statement: Statement) -> Iterator[str]:
        forms = self.forms
        match statement:
            case SetTo(name, tree, note, new):
                form = forms.new if new else forms.assign
                yield form.format(self.texts.get(name, name), self.spell(tree)) + forms.note(note)
            case Declare(names) if names and forms.declare:
                yield forms.declare.format(", ".join(names))
            case Recall(name) if name in self.memory:
                yield forms.load.format(self.texts.get(name, name), self.memory[name])
            case Keep(name, tree):
                place = self.memory.get(name, self.texts.get(name, name))
                yield forms.assign.format(place, self.spell(tree))
            case Enter(state):
                yield self.enter(state)
            case Verbatim(text):
                yield text
            case Guards(edges):
                tests = [(self.spell(edge.guard), taken, edge.name) for edge, taken in edges]
                yield from self._choice(tests)
            case ByState(branches):
                yield from self._by_state(branches)
            case TwoWays(test, body, other):
                yield from self._choice([(test, body, ""), ("", other, "")])
            case ForEach(body) if self.index:
                yield forms.loop.format(self.index, self.count)
                yield from indented(self.lines(body))
                yield forms.end_loop
            case ForEach(body):
                yield from self.lines(body)

    def _by_state(self, branches: Sequence[Sequence[Statement]]) -> Iterator[str]:
        if len(branches) == 1:
            yield from self.lines(branches[0])
            return
        rows = [(self.test(k), body, self.states[k]) for k, body in enumerate(branches) if body]
        if len(rows) == len(branches):  # whoever is in no other state is in the last one
            _, body, name = rows[-1]
            rows[-1] = "", body, name
        if rows:
            yield from self._choice(rows)

    def _choice(self, rows: Sequence[tuple[str, Sequence[Statement], str]]) -> Iterator[str]:
        """Write a chain of tests; the last test may be empty: otherwise."""
        form = self.forms.first
        for test, body, note in rows:
            yield (form if test else self.forms.other).format(test) + self.forms.note(note)
            yield from indented(self.lines(body) or [*filter(None, [self.forms.nothing])])
            form = self.forms.then
        yield self.forms.end


def indented(lines: Iterable[str], by: str = "    ") -> list[str]:
    """Return lines, further to the right."""
    return [f"{by}{line}" for line in lines]
