"""C99 for people: blocks as nested structs with the names of their records, and typed pointers.

The structs are those of the layout (`integrators.machine_code.layout`); nothing describes them a
second time. What no function reads or writes is left out of them.
"""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from integrators.machine_code.c99 import (
    HEAD,
    HELPERS,
    RESERVED,
    TYPES,
    CFields,
    CNames,
    CWriter,
    number_text,
    structure_text,
    table_text,
)
from integrators.machine_code.front_end.values import ArrayValue, NumberValue, RecordValue
from integrators.machine_code.layout import BlockLayout
from integrators.machine_code.readable.possible import changing_of
from integrators.machine_code.tree import (
    SIZES,
    Address,
    AddressOf,
    AssignMany,
    Const,
    Expr,
    Global,
    Load,
    Local,
    Module,
    Return,
    Statement,
    TypedFunction,
    expressions_in,
)

__all__ = ["CBlock", "records_text"]


@dataclass(frozen=True)
class _Member:
    """A number, or an array of numbers, in the struct."""

    path: tuple[str, ...]
    kind: str
    offset: int  # in bytes
    length: int | None  # of an array
    about: str = ""

    @property
    def end(self) -> int:
        return self.offset + SIZES[self.kind] * (1 if self.length is None else self.length)


@dataclass
class CBlock:
    """The struct of a block."""

    name: str
    layout: BlockLayout
    # Names of the parts of tuples that have none, by the way to the tuple.
    parts: Mapping[str, Sequence[str]] = field(default_factory=dict)
    open: Collection[str] = ()  # outer records whose members are members of the struct itself
    used: set[tuple[str, ...]] = field(default_factory=set)  # what is in the struct

    def __post_init__(self) -> None:
        assert isinstance(self.layout.value, RecordValue)
        self.members = [*self._members(self.layout.value, ())]

    def place(self, offset: int, kind: str) -> _Member | None:
        """Return the member at an offset, in bytes."""
        found = (u for u in self.members if u.offset <= offset < u.end and u.kind == kind)
        return next(found, None)

    def text(self, word: int, pointer: str = "block", index: str = "") -> str:
        """Write the number in a word of the block, or one that follows it in its array.

        Examples
        --------
        >>> from integrators.step_size import Control
        >>> control = Control(0.0, 0.0, 1e-6, [0.0, 0.5], 1.0, 0.0)
        >>> block = CBlock("engine", BlockLayout(control, lambda part: False))
        >>> block.text(4), block.text(2)
        ('block->atol[1]', 'block->rtol')
        """
        for kind in "fi":
            if member := self.place(8 * word, kind):
                first = (8 * word - member.offset) // 8
                at = f"{first} + {index}" if first and index else index or str(first)
                return self.entry(member, at, pointer)
        raise KeyError(word)

    def entry(self, member: _Member, index: str, pointer: str) -> str:
        """Write a number of a member."""
        self.used.add(member.path)
        at = "" if member.length is None else f"[{index}]"
        return f"{pointer}->{'.'.join(member.path)}{at}"

    def declared(self) -> str:
        """Return the definition of the struct, with the members that are used."""
        rows: list[str] = []
        now: tuple[str, ...] = ()
        for each in self.members:
            if each.path not in self.used:
                continue
            *owners, name = each.path
            shared = _shared(now, owners)
            rows += [f"{'    ' * (k + 1)}}} {now[k]};" for k in range(len(now) - 1, shared - 1, -1)]
            rows += [f"{'    ' * (k + 1)}struct {{" for k in range(shared, len(owners))]
            now = tuple(owners)
            length = "" if each.length is None else f"[{each.length}]"
            about = f" /* {each.about} */" if each.about else ""
            space = "    " * (len(owners) + 1)
            rows.append(f"{space}{TYPES[each.kind]} {name}{length};{about}")
        rows += [f"{'    ' * (k + 1)}}} {now[k]};" for k in range(len(now) - 1, -1, -1)]
        return "\n".join(["typedef struct {", *rows, f"}} {self.name};"])

    def _members(self, value: RecordValue, way: tuple[str, ...]) -> Iterator[_Member]:
        notes, names = _notes(value.cls), self.parts.get(".".join(way))
        for k, (name, part) in enumerate(value.fields.items()):
            plain = name if name.isidentifier() else names[k] if names else f"part_{name}"
            path, about = (*way, plain), notes.get(name, "")
            match part:
                case NumberValue(expr=Load(kind=kind, address=address)):
                    yield _Member(path, kind, address.offset, None, about)
                case ArrayValue(kind=kind, dims=(), offset=offset):
                    yield _Member(path, kind, offset, None, about)
                case ArrayValue(kind=kind, dims=dims, offset=offset):
                    lengths = [each.value for each in dims if isinstance(each, Const)]
                    if len(lengths) > 1:
                        about = "; ".join([*filter(None, [about]), " x ".join(map(str, lengths))])
                    if total := math.prod(lengths):
                        yield _Member(path, kind, offset, total, about)
                case RecordValue():
                    yield from self._members(part, path if way or name not in self.open else ())


def _shared(a: Sequence[str], b: Sequence[str]) -> int:
    """Return how many names two ways have in common at their beginning."""
    return next(
        (k for k, (u, v) in enumerate(zip(a, b, strict=False)) if u != v), min(len(a), len(b))
    )


def _notes(record: Any) -> Mapping[str, str]:
    """Return what the text of a record says of its fields, in comments beside them."""
    try:
        text = inspect.getsource(record)
    except (OSError, TypeError):
        return {}
    found = re.findall(r"^    (\w+): [^#\n]*#[ ]*(.+)$", text, re.MULTILINE)
    return {name: about.replace("*/", "* /") for name, about in found}


# --------------------------------------------------------------------------- the text
def records_text(module: Module, block: CBlock | None = None, taken: Iterable[str] = ()) -> str:
    """Return a module as C99 with typed pointers; its entries are static, too.

    Examples
    --------
    >>> from integrators.machine_code.front_end.translate import Translator
    >>> from integrators.step_size import Control
    >>> from integrators.machine_code.front_end.values import NumberValue
    >>> from integrators.step_size import error_norm
    >>> layout = BlockLayout(([0.0], [1.0], [1.0], [1e-9]), lambda part: False)
    >>> parts = [layout.part(str(k)) for k in range(4)]
    >>> numbers = [NumberValue(Local("f", name)) for name in ("h", "rtol")]
    >>> translator = Translator()
    >>> e, y, y_new, atol = parts
    >>> _ = translator.entry("entry", error_norm, [e, numbers[0], y, y_new, numbers[1], atol])
    >>> text = records_text(translator.module, CBlock("engine", layout))
    >>> print(text[text.index("static double entry"):].strip())
    static double entry(const engine *block, double h, double rtol)
    {
        return error_norm(block->part_0, h, block->part_1, block->part_2, rtol, block->part_3);
    }
    """
    kinds = sorted({f.results for f in module.functions if len(f.results) > 1})
    known = {*RESERVED.split(), *taken, *(table.name for table in module.tables)}
    constants = _named_constants(module, known)
    known |= {*constants}
    functions = CNames(known)
    known |= {functions(f.name) for f in module.functions}
    if block:
        known.add(block.name)
    results = {f.name: f.results for f in module.functions}
    changing = changing_of(module)
    texts = [
        _NamedWriter(f, results, functions, CNames(known), block, constants, changing).text(
            static=True
        )
        for f in module.functions
    ]
    parts = [*map(structure_text, kinds), *map(table_text, module.tables), *texts]
    text = "\n".join(parts)
    used = [each for name, each in HELPERS.items() if re.search(rf"\b{name}\b", text)]
    return "\n".join([HEAD, *used, *_constants_text(constants, text), "", text])


def _named_constants(module: Module, taken: Collection[str]) -> Mapping[str, Const]:
    """Return the constants that have one value under their name."""
    found: dict[str, Const] = {}
    several = set[str]()
    for function in module.functions:
        for each in expressions_in(function.body):
            match each:
                case Const(name=name) if name.isupper() and name not in taken:
                    if found.setdefault(name, each) != each:
                        several.add(name)
    return {k: v for k, v in found.items() if v.value - v.value == 0 and k not in several}


def _constants_text(constants: Mapping[str, Const], text: str) -> Iterator[str]:
    used = {k: v for k, v in constants.items() if re.search(rf"\b{k}\b", text)}
    whole = [f"    {k} = {v.value}" for k, v in used.items() if v.kind == "i"]
    if whole:
        yield "enum {\n" + ",\n".join(whole) + "\n};"
    for k, v in used.items():
        if v.kind == "f":
            yield f"static const double {k} = {number_text(v.value)};"


class _NamedWriter(CWriter):
    """Writes one function with members of structs, and typed pointers."""

    def __init__(
        self,
        function: TypedFunction,
        results: dict[str, str],
        functions: CNames,
        locals_: CNames,
        block: CBlock | None,
        constants: Mapping[str, Const],
        changing: Collection[tuple[str, str]],
    ) -> None:
        self.record, self.constants, self.changing = block, constants, changing
        super().__init__(function, results, functions, locals_, CFields(()))

    def declared(self, local: Local) -> str:
        """Write the type of a local."""
        if local.kind != "p":
            return f"{TYPES[local.kind]} "
        if not local.to:
            assert self.record is not None
            type_ = self.record.name
        else:
            type_ = TYPES[local.to]
        kept = "" if (self.function.name, local.name) in self.changing else "const "
        return f"{kept}{type_} *"

    def heading(self) -> str:
        """Write what stands before a function."""
        about = re.sub(r"`(?:[\w.]+\.)?(\w+)`", r"\1", self.function.about)
        return f"/* {about} */\n" if about and not self.function.entry else ""

    def block(self, body: Sequence[Statement], depth: int) -> list[str]:
        """Write statements; results that are only returned have no names."""
        match body:
            case (*others, AssignMany(targets=targets, call=call), Return(values=values)) if (
                targets == values and self.results[call.name] == self.function.results
            ):
                body = *others, Return((call,))
        return super().block(body, depth)

    def bare(self, expr: Expr) -> tuple[str, int]:
        """Write an expression; return also how tightly it binds."""
        if isinstance(expr, Const) and self.constants.get(expr.name) == expr:
            return expr.name, 11
        if isinstance(expr, Global):
            return expr.name, 11
        return super().bare(expr)

    # ------------------------------------------------------------------ memory
    def _place(self, address: Address, kind: str) -> tuple[str, str, bool]:
        """Return an array and an index in it; the array is a number if the flag is set."""
        base, offset = address.base, address.offset
        name = ""
        single = False
        if isinstance(base, Local) and not base.to:
            assert self.record is not None
            self.read.add(base.name)
            member = self.record.place(offset, kind)
            if member is None:
                raise ValueError(f"no number of kind {kind} is at {address}")
            self.record.used.add(member.path)
            name = f"{self.name(base.name)}->{'.'.join(member.path)}"
            offset -= member.offset
            single = member.length is None
        elif isinstance(base, Global):
            name = base.name
        else:
            name = self.value(base, 11)
        first = offset // SIZES[kind]
        index = "" if address.index is None else self.value(address.index, 8 if first else 0)
        index = f"{index} + {first}" if index and first else index or str(first)
        return name, index, single

    def place(self, kind: str, address: Address) -> str:
        """Write a place in memory."""
        name, index, single = self._place(address, kind)
        return name if single else f"{name}[{index}]"

    def address_of(self, expr: AddressOf) -> tuple[str, int]:
        """Write an address."""
        base, block = expr.address.base, self.record
        if isinstance(base, Local) and not base.to and block is not None:
            member = block.place(expr.address.offset, expr.to)
            if member is None:  # of an empty array
                return "NULL", 11
        name, index, single = self._place(expr.address, expr.to)
        if single:
            return f"&{name}", 10
        return (name, 11) if index == "0" else (f"&{name}[{index}]", 10)
