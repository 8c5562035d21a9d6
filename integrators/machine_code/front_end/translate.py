"""The front end: plain Python functions, specialised for the types of their arguments.

The subset: numbers, arrays of one or two dimensions, named tuples (also new ones), ``for`` over
ranges and arrays, ``while``, ``if``, the usual operators, ``abs``, ``min``, ``max``, ``len``, the
functions of `integrators.elementary`, and calls of other functions of the subset, which may be
passed as arguments. Integers have 64 bits. What a function does to numbers is exactly what Python
does, operation by operation, except that nothing raises: a division by zero gives inf or NaN.

A named tuple is never built in memory. Its fields are known while translating; a function that
takes one is translated once for each kind of it, and receives the few addresses that its fields are
found from. So is a dataclass, whose numbers are in memory and can be assigned (`records`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from integrators.machine_code.front_end.expressions import FOREIGN, HostFunction
from integrators.machine_code.front_end.passing import passed_of, take
from integrators.machine_code.front_end.sources import Source, TranslationError, source_of
from integrators.machine_code.front_end.statements import body
from integrators.machine_code.front_end.values import (
    ArrayValue,
    NumberValue,
    RecordForms,
    Value,
    leaves,
)
from integrators.machine_code.front_end.work import Again, Learnt, Specialised, Work
from integrators.machine_code.tree import (
    Address,
    AddressOf,
    Assign,
    Const,
    ConstantTable,
    Do,
    Expr,
    For,
    Global,
    Invoke,
    Local,
    Module,
    Op,
    Return,
    Statement,
    TypedFunction,
    locals_in,
)

__all__ = ["HostFunction", "TranslationError", "Translator"]


class Translator:
    """Translates functions into one module.

    Parameters
    ----------
    inline : mapping of str to bool, optional
        By a function's name whether it is put inline (if it is short), or not; LLVM decides about
        the others.
    apart : mapping of str to tuple of str, optional
        By a function's name its arguments that overlap no others.

    Attributes
    ----------
    module : Module
        The functions so far.
    origins : dict of str to str
        By their names in the module: their own names.

    Examples
    --------
    >>> from integrators.machine_code.front_end.values import NumberValue
    >>> from integrators.step_size import root_of
    >>> translator = Translator()
    >>> arguments = [NumberValue(Local("f", "error")), NumberValue(Local("i", "order"))]
    >>> translator.entry("root", root_of, arguments).results
    'f'
    >>> [function.name for function in translator.module.functions]
    ['root_of', 'root']
    """

    def __init__(
        self,
        inline: Mapping[str, bool] | None = None,
        apart: Mapping[str, tuple[str, ...]] | None = None,
    ) -> None:
        self.inline, self.apart = inline or {}, apart or {}
        self.module = Module()
        self.origins: dict[str, str] = {}  # by the name of a translation: the function's own
        self.forms = RecordForms()
        self._done: dict[Any, Specialised] = {}
        self._sources: dict[int, Source] = {}
        self._kept: list[Any] = []  # objects whose `id` is part of a key
        self._made: dict[Any, list[TypedFunction]] = {}
        self._names = {*FOREIGN.values(), "callbacks"}
        self._tables: dict[str, ArrayValue] = {}

    def entry(
        self, name: str, function: Callable[..., Any], arguments: Sequence[Value]
    ) -> TypedFunction:
        """Add a function that can be called from outside.

        Parameters
        ----------
        name : str
            Its name outside.
        function : callable
            A Python function of the subset.
        arguments : sequence of Value
            In terms of the parameters of the entry, which are its locals in order of appearance.

        Returns
        -------
        TypedFunction
            The entry; it returns what the function returns, which must be one number or nothing.

        Raises
        ------
        TranslationError
            If a line is not part of the subset.
        """
        self._names.add(name)
        passed, types = passed_of(arguments, self.forms)
        done = self.translated(function, arguments, types)
        parameters: dict[Local, None] = {}
        for argument in arguments:
            for expr in _expressions(argument):
                parameters.update(dict.fromkeys(locals_in(expr)))
        kind = done.slots[0].kind if isinstance(done.result, NumberValue) else ""
        call = Invoke(kind, done.function.name, tuple(passed))
        made: tuple[Statement, ...] = (Return((call,)),) if kind else (Do(call), Return(()))
        entry = TypedFunction(name, tuple(parameters), kind, (), made, entry=True)
        self.module.functions.append(entry)
        return entry

    def for_each(self, name: str, entry: TypedFunction, words: int) -> TypedFunction:
        """Add a function that calls an entry for many blocks, one after the other in memory.

        Parameters
        ----------
        name : str
            Its name outside.
        entry : TypedFunction
            Its only parameter is the address of a block; it returns an integer.
        words : int
            Length of a block.

        Returns
        -------
        TypedFunction
            With the address of the first block and their number as parameters. It returns the sum
            of what the entry returned.
        """
        self._names.add(name)
        (block,) = entry.parameters
        count, i, total = (Local("i", each) for each in ("count", "i", "total"))
        here = Address(block, 0, Op("i", "*", (i, Const("i", words))))
        result = Invoke("i", entry.name, (AddressOf(here),))
        add = Assign(total, Op("i", "+", (total, result)))
        loop = For(i, Const("i", 0), count, 1, (add,))
        body = (Assign(total, Const("i", 0)), loop, Return((total,)))
        made = TypedFunction(name, (block, count), "i", (i, total), body, entry=True)
        self.module.functions.append(made)
        return made

    def translated(
        self,
        function: Callable[..., Any],
        arguments: Sequence[Value],
        types: tuple[Any, ...] | None = None,
    ) -> Specialised:
        """Return a function specialised for the types of its arguments.

        Parameters
        ----------
        function : callable
            A Python function of the subset.
        arguments : sequence of Value
            In terms of the caller's locals.
        types : tuple, optional
            What `passed_of` returns of them.

        Returns
        -------
        Specialised
            The same one for arguments of the same types.
        """
        key = id(function), passed_of(arguments, self.forms)[1] if types is None else types
        if key not in self._done:
            self._kept.append((function, arguments))
            self._done[key] = self._specialised(function, arguments)
        return self._done[key]

    def source(self, function: Callable[..., Any]) -> Source:
        """Return the text of a function, read once."""
        if (found := self._sources.get(id(function))) is None:
            self._sources[id(function)] = found = source_of(function)  # which keeps the function
        return found

    def table(self, values: tuple[Any, ...]) -> ArrayValue:
        """Return constants as an array in memory; ragged rows are padded with zeros.

        Parameters
        ----------
        values : tuple
            Of numbers, or of tuples of numbers.

        Returns
        -------
        ArrayValue
            The same one for the same values.
        """
        key = repr(values)
        if key not in self._tables:
            rows = values if values and isinstance(values[0], tuple) else None
            width = max(map(len, rows)) if rows else len(values)
            flat = [v for row in rows or (values,) for v in (*row, *[0.0] * (width - len(row)))]
            name = f"table{len(self._tables)}"
            self.module.tables.append(ConstantTable(name, "f", tuple(map(float, flat))))
            dims = (Const("i", len(rows)), Const("i", width)) if rows else (Const("i", width),)
            self._tables[key] = ArrayValue("f", dims, Global(name))
        return self._tables[key]

    def _specialised(self, function: Callable[..., Any], arguments: Sequence[Value]) -> Specialised:
        learnt = Learnt()
        while True:
            work = Work(self, function, learnt)
            try:
                take(work, arguments)
                statements = body(work)
            except Again:
                continue
            break
        slots = tuple(work.slots.values())
        variables = tuple(work.variables.values())
        kinds = "".join(slot.kind for slot in slots)
        name = function.__name__.strip("_")
        inline = self.inline.get(function.__name__)
        about = (function.__doc__ or "").strip().partition("\n")[0]
        made = TypedFunction(
            name,
            tuple(work.parameters),
            kinds,
            variables,
            statements,
            inline=inline,
            about=about,
            apart=self.apart.get(function.__name__, ()),
        )
        # Other types may have led to the same statements.
        alike = self._made.setdefault((id(function), replace(made, body=())), [])
        for other in alike:
            if other.body == statements:
                return Specialised(other, work.first.get("return"), slots)
        made = replace(made, name=self._free(name))
        self.origins[made.name] = function.__name__
        alike.append(made)
        self.module.functions.append(made)
        return Specialised(made, work.first.get("return"), slots)

    def _free(self, name: str) -> str:
        """Return a name that no function has yet."""
        number, free = 0, name
        while free in self._names:
            number += 1
            free = f"{name}_{number}"
        self._names.add(free)
        return free


def _expressions(value: Value) -> list[Expr]:
    """Return the expressions of a value."""
    found: list[Expr] = []
    for leaf in leaves(value):
        if isinstance(leaf, NumberValue):
            found.append(leaf.expr)
        elif isinstance(leaf, ArrayValue):
            found += [leaf.base, *([] if leaf.index is None else [leaf.index]), *leaf.dims]
    return found
