"""The engine of a live page: a system as a script that runs it again with other numbers.

It is the module of `gms_fsm.exporters.targets.js` without its face: the page has the memory, and
reads the rows themselves.
"""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from gms_fsm.charts.parameters import WEIGHTS
from gms_fsm.exporters._adapting import word_of
from gms_fsm.exporters._quantities import Quantity
from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.targets.js import RunModule
from gms_fsm.lowering.adapting import Adapting
from gms_fsm.lowering.compiling import functions
from gms_fsm.run.problem import Problem
from gms_fsm.systems.mounted import Mounted
from gms_fsm.systems.numbers import NUMBERS, numbers_of
from gms_fsm.systems.reading.values import CURVE, MODEL, WEIGHT
from integrators import loop
from integrators.machine_code.front_end.translate import Translator
from integrators.machine_code.front_end.values import NumberValue
from integrators.machine_code.layout import OuterArray
from integrators.machine_code.script.compact import compact
from integrators.machine_code.script.javascript import javascript_text, tables_of
from integrators.machine_code.script.placed import placed
from integrators.machine_code.tree import Const, Local
from integrators.machine_code.tuning import INLINE
from integrators.runners.observing import value_rows

PLACES = {
    "time_scale": "buffers.plan.control.time_scale",
    "clock": "buffers.now.t",
    "machine": "buffers.memory.machine",
    "row": "buffers.out.row",
    "firings": "log.firings",
}
SHORT, DIGITS = 16, 10  # numbers that are not looked at, and decimals that are tried
ENTRIES = ("record", "adapt", "show", "values")
VALUES = (
    "more.values functions.p more.calm buffers.out.rows_t buffers.out.rows_y log.rows_mode "
    "more.shown"
)


class LiveRun(NamedTuple):
    """What further entries of a live run need: `more` of its arguments."""

    adapting: Adapting
    table: Any  # observed values of the rows
    values: Any
    calm: list[int]
    shown: Any  # what guards read at the rows


@dataclass(frozen=True, eq=False)
class LiveEngine:
    """A system as a script.

    Parameters
    ----------
    text : str
        The script: an object with the functions and what their memory is at the start.
    numbers : mapping of str to tuple of int
        The words in the memory of each number, by its name in `gms_fsm.systems.numbers`.
    words : mapping of str to int
        The first word of each number that the system's program reads, by its name there.
    """

    text: str
    numbers: Mapping[str, tuple[int, ...]]
    words: Mapping[str, int]


def live_engine(start: Problem, title: str) -> LiveEngine:
    """Return the engine of a run; a `ParameterError` if it cannot be printed."""
    subject = Subject(
        "live", title, "js", start.system, None, None, start.initial, start.t_start, start.chosen,
        start.t_end,
    )  # fmt: skip
    made = _LiveModule(subject)
    return LiveEngine(made.script(), made.numbers_by_name(start.what), made.words())


class _LiveModule(RunModule):
    """The module of a live page."""

    def more(self, start: Problem) -> tuple[Any, ...]:
        """Return what further entries need."""
        program, shown = start.program, OuterArray("f", max(start.program.layout.shown.size, 1))
        adapting, table = super().more(start)
        return LiveRun(adapting, table, functions(program)["values"], program.calm, shown)

    def entries(self, translator: Translator) -> list[str]:
        """Translate also what guards read at the rows."""
        super().entries(translator)
        read = [self.layout.part(each) for each in VALUES.split()]
        translator.entry("values", value_rows, [*read, NumberValue(Local("i", "count"))])
        return [*ENTRIES]

    def script(self) -> str:
        """Return an object of JavaScript."""
        translator = Translator(INLINE)
        self.entries(translator)
        _, tables = tables_of(translator.module)
        module = placed(translator.module, {"block": Const("p", 8 * len(tables))})
        code = compact(javascript_text(module), ENTRIES)
        image, true = self.image()
        place, layout = self.layout.offset, self.start.program.layout
        known = {
            "words": self.layout.words,
            "true": true,
            "tables": floats_text(tables),
            "columns": {name: _stored(each) for name, each in self.growing().items()},
            "sizes": {
                "y": layout.y.size,
                "mode": layout.modes,
                "seen": layout.observed.size,
                "shown": max(layout.shown.size, 1),
            },
            "places": {name: place(path) for name, path in PLACES.items()},
            "codes": {"ROWS": loop.ROWS, "DONE": loop.DONE, "LIVELOCK": loop.MACHINE_LIVELOCK},
            "failures": self.failures(),
            "elements": self.elements(),
            "banks": [[bank.first, bank.first_edge, bank.n] for bank in layout.banks],
        }
        data = json.dumps(known, separators=(",", ":")).replace("<", "\\u003c")
        words = ",".join(f"{k},{value}" for k, value in image)
        made = f"functions(F,B){{{code}return{{{','.join(ENTRIES)}}}}}"
        return f"({{known:{data},\nimage:[{words}],\n{made}}})"

    # ------------------------------------------------------------------ numbers
    def words(self) -> dict[str, int]:
        """Return the first word of each number of the program."""
        names = self.start.program.plan.names
        shared, own = self.layout.offset("functions.p.0"), self.layout.offset("functions.p.1")
        width = max((each.length or 0 for each in self.numbers), default=0)
        found = {name: shared + k for k, name in enumerate(names.shared)}
        return found | {name: own + k * width for k, name in enumerate(names.own)}

    def numbers_by_name(self, what: Mounted) -> dict[str, tuple[int, ...]]:
        """Return the words of the numbers that can be changed."""
        places = {_plain(each, what): (word_of(self.layout, each), each) for each in self.numbers}
        found: dict[str, tuple[int, ...]] = {}
        for name, number in numbers_of(what).items():
            if number.whole not in places:
                continue
            first, quantity = places[number.whole]
            count = quantity.length or 1
            chosen = range(count) if number.element is None else [number.element]
            found[name] = tuple(first + k for k in chosen)
        return found


def _plain(each: Quantity, what: Mounted) -> str:
    """Return what the user calls a number of the program."""
    owner, _, own = each.label.rpartition(".")
    own = own.removeprefix(CURVE).removeprefix(MODEL).replace(WEIGHT, WEIGHTS.name)
    if not what.named:
        return own
    return what.of(owner or NUMBERS, own)


def _stored(column: dict[str, Any]) -> dict[str, Any]:
    data = np.array(column.pop("data"), dtype=np.float64)
    rows = data.reshape(-1, column["width"]) if column["width"] > 1 else [data]
    return {**column, "data": [*map(floats_text, rows)]} if data.size else column


def floats_text(values: Any) -> str | list[float]:
    """Return floats as base64, in which a long run of A, zero bytes, is its length: ``-12-``.

    Of evenly spaced decimal numbers, as times of a record are: the first and the step in units of
    their last digit, how many of these are 1, and how many numbers there are.

    Examples
    --------
    >>> floats_text([0.5, 0.0, 0.0, 0.0])
    '-8-4D8-32-='
    >>> floats_text([1.0 + k / 20.0 for k in range(100)])
    [100.0, 5.0, 100.0, 100]
    """
    floats = np.asarray(values, dtype="<f8")
    count, data = len(floats), floats.tobytes()
    for unit in (10.0**digits for digits in range(DIGITS if count > SHORT else 0)):
        first, after = map(float, np.rint(floats[:2] * unit))
        if ((first + np.arange(count) * (after - first)) / unit).tobytes() == data:
            return [first, after - first, unit, count]
    text = base64.b64encode(data).decode()
    return re.sub("A{5,}", lambda found: f"-{len(found[0])}-", text)
