"""The C sources of an FMU: the engine, translated, and what the fixed sources must know of it.

The rules are those of `integrators.runners.stepping` (Co-Simulation) and
`integrators.runners.exchange` (Model Exchange), which both run `integrators.loop` on one block of
memory; there is no rule here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from gms_fsm._version import __version__
from gms_fsm.exporters._adapting import PLACES, STEPS, translate
from gms_fsm.exporters._c import TEMPLATES, filled, safe
from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.fmi.variables import FmuVariable, indicators_of, nominals_of, types_of
from gms_fsm.lowering.adapting import Adapting
from gms_fsm.run.recording.following import adapting_of
from gms_fsm.run.stepped.failing import FAILURES
from gms_fsm.run.stepped.memory import MOST_IN_EXPORTS, arguments_of
from integrators.machine_code.c99 import c99_text, number_text
from integrators.machine_code.front_end.translate import Translator
from integrators.machine_code.layout import BlockLayout, MemoryBlock
from integrators.machine_code.tuning import INLINE
from integrators.runners import exchange, stepping
from integrators.runners.compiled import is_known
from integrators.runners.exchange import Exchange

ENTRIES: Mapping[str, tuple[Any, str]] = {
    **STEPS,
    "restart": (stepping.restart, "buffers sample.clocks"),
    "settle": (exchange.settle, "functions machines buffers sample.clocks exchange"),
    "slope": (exchange.slope, "functions buffers exchange"),
    "indicate": (exchange.indicate, "functions buffers exchange"),
    "changed": (exchange.changed, "functions buffers exchange"),
    "observe": (exchange.observe, "functions machines buffers exchange"),
}
# Further names of the C text.
OWN = ("IN_BLOCK", "INPUT", "SEEN", "INDICATOR", "STATE", "TIME", "place", "variable", "word")


class FmuArguments(NamedTuple):
    """The arguments of all entries."""

    functions: Any
    machines: Any
    buffers: Any
    sample: Any
    exchange: Exchange
    adapting: Adapting


class FmuModel:
    """The engine of an FMU.

    Parameters
    ----------
    subject : Subject
        A friction or a system.
    variables : sequence of FmuVariable
        Of the FMU.
    exchange : bool
        Whether there is Model Exchange.
    """

    def __init__(
        self, subject: Subject, variables: Sequence[FmuVariable], *, exchange: bool
    ) -> None:
        self.subject, self.variables, self.exchange = subject, variables, exchange
        self.arguments = both_of(subject)
        self.layout = BlockLayout(self.arguments, is_known)

    @property
    def nominals(self) -> dict[int, float]:
        """Scales of the continuous states, by value reference."""
        scales = nominals_of(self.subject.start)
        return {
            k: scales[each.index] for k, each in enumerate(self.variables) if each.continuous_state
        }

    def sources(self, version: int, token: str) -> dict[str, str]:
        """Return the contents of the folder ``sources``."""
        return {
            f"fmi{version}.c": (TEMPLATES / "fmi/fmi.c").read_text(encoding="utf-8"),
            f"{self.subject.name}_engine.c": self.engine(),
            "fmu_core.h": (TEMPLATES / "fmi/fmu_core.h").read_text(encoding="utf-8"),
            "model.h": self.header(version, token),
        }

    # ------------------------------------------------------------------ engine
    def engine(self) -> str:
        """Return the functions on the block of memory, and its contents at the start."""
        name, translator = self.subject.name, Translator(INLINE)
        translate(translator, self.layout, ENTRIES, "fmu_")
        taken = [f"{name}_{each}" for each in (*ENTRIES, "start", "derive")]
        return filled(
            "fmi/fmu_engine.c",
            name=name,
            title=safe(self.subject.title),
            version=__version__,
            engine=c99_text(translator.module, [*taken, *self._constants(), *OWN], hidden=True),
            words=self.layout.words,
            image=_image(self.layout, self.arguments),
            time_scale=self.layout.offset("buffers.plan.control.time_scale"),
        )

    # ------------------------------------------------------------------ model.h
    def header(self, version: int, token: str) -> str:
        """Return what the fixed sources must know: names, places in the block, variables."""
        constants = self._constants()
        counts = {kind: len(names) for kind, names in types_of(self.subject.start).items()}
        rows = []
        for each in self.variables:
            offset = each.index
            if each.array:
                offset += self.layout.offset(PLACES[each.array])
            elif each.place == "COUNT":
                offset = constants["SWITCHED"]
            settable = counts[each.kind] if each.kind else int(bool(each.array))
            rows.append(f"    {{{each.place}, {settable}, {offset}}}, /* {each.name} */")
        reasons = [f'    case {code}: return "{reason}";' for code, (_, reason) in FAILURES.items()]
        places = [each.index + constants["Y"] for each in self.variables if each.continuous_state]
        return filled(
            "c/model.h",
            name=self.subject.name,
            title=safe(self.subject.title),
            token=token,
            version=version,
            constants="\n".join(f"#define {key} {value}" for key, value in constants.items()),
            variables="\n".join(rows),
            places=", ".join(map(str, places)) or "0",
            nominals=", ".join(map(number_text, self.nominals.values())) or "0",
            reasons="\n".join(reasons),
        )

    def _constants(self) -> dict[str, int]:
        """Return sizes, and places in the block."""
        place = self.layout.offset
        return {
            "INPUTS": len(self.subject.inputs),
            "WORDS": self.layout.words,
            "VARIABLES": len(self.variables),
            "STATES": len(self.nominals),
            "INDICATORS": len(self.arguments.exchange.indicators),
            "HAS_EXCHANGE": int(self.exchange),
            "CLOCK": place("buffers.now.t"),
            "FOREIGN": place("buffers.plan.foreign"),
            "TABLES": place("functions.p.2"),
            "Y": place("buffers.now.y"),
            "LENGTH": len(self.arguments.buffers.now.y),
            "OBSERVED": place("exchange.seen"),
            "SLOPE": place("exchange.slope"),
            "INDICATORS_AT": place("exchange.indicators"),
            "GIVEN": place("adapting.given"),
            "SWITCHED": place("exchange.switches"),
            "MOVED": place("exchange.moved"),
            "NEXT": place("exchange.next"),
            "SAMPLE_END": place("sample.end"),
            "SAMPLE_INPUTS": place("sample.inputs"),
            "SAMPLE_SWITCHES": place("sample.switches"),
            "SAMPLE_RESUMED": place("sample.resumed"),
            "FULL_LOG": stepping.FULL_LOG,
        }


def _image(layout: BlockLayout, arguments: Any) -> str:
    """Return C text that sets all words of a block that are not zero at the start."""
    names = {offset: name for name, offset in layout.offsets.items()}
    lines = []
    for k, value in MemoryBlock(layout, arguments).set_words():
        note = f" /* {names[k]} */" if k in names else ""
        if isinstance(value, float):
            lines.append(f"    w[{k}].f = {number_text(value)};{note}")
        elif isinstance(value, int):
            lines.append(f"    w[{k}].i = {value};{note}")
        else:
            lines += [f"    w[{k}].b[{j}] = true;{note}" for j, true in enumerate(value) if true]
    return "\n".join(lines)


def both_of(subject: Subject) -> FmuArguments:
    """Return the arguments of all entries, made of lists."""
    start, alone = subject.start, subject.alone
    functions, machines, buffers, sample = arguments_of(start, most=MOST_IN_EXPORTS)
    size, relations = len(buffers.now.y), len(buffers.relations.watch)
    indicators = indicators_of(start, alone)
    assert len(indicators) == relations
    made = Exchange(
        next=math.inf,
        switches=0,
        moved=False,
        slope=[0.0] * size,
        seen=[0.0] * len(sample.seen),
        margins=[0.0] * relations,
        indicators=[1.0] * relations,
        shift=[each.shift for each in indicators],
        before=[0.0] * size,
        signs=[0.0] * len(buffers.now.held),
    )
    return FmuArguments(functions, machines, buffers, sample, made, adapting_of(start))
