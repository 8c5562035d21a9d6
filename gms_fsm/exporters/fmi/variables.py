"""The variables of an FMU, the same for both versions of FMI."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from gms_fsm.exporters._c import WORDS
from gms_fsm.exporters._quantities import Quantity, outputs_of, parameters_of
from gms_fsm.exporters._subject import Subject
from gms_fsm.foundation.quantities import per_second
from gms_fsm.language import Binary, comparisons, names_in, split
from gms_fsm.lowering.adapting import SHARE
from gms_fsm.lowering.printing.plan import plan_of
from gms_fsm.lowering.scales import scales_of_system
from gms_fsm.run.problem import Problem
from integrators.sliding import MOST_SLIDING

# How far behind its crossing an indicator is zero, as a part of the scale of what is compared: far
# above the rounding errors at the root, far below the tolerances (which are 1e-7 of it).
BEHIND = 1e-11


@dataclass(frozen=True)
class FmuVariable:
    """A variable of an FMU; its place in the list is its value reference.

    Parameters
    ----------
    name : str
        With dots between parts, and numbers of elements in brackets.
    place : str
        Where it is, as `_fmu_core.h` calls the places: IN_BLOCK, INPUT, SEEN, SLOPES, INDICATOR,
        STATE, COUNT, TIME.
    index : int
        There; for words of the block, the index in the array `array`.
    array : str
        Of the block: y, mode, shared, own; empty for other places.
    causality, variability, initial : str
        As in the standard.
    start : float or None
        None if it is calculated.
    unit, meaning : str
        Empty if unknown.
    of : int or None
        Of a derivative: the reference of its state.
    kind : str
        Name of the enumeration of a STATE.
    """

    name: str
    place: str
    index: int = 0
    array: str = ""
    causality: str = "local"
    variability: str = "continuous"
    initial: str = "calculated"
    start: float | None = None
    unit: str = ""
    meaning: str = ""
    of: int | None = None
    kind: str = ""

    @property
    def calculated(self) -> bool:
        """Whether it is computed during the initialization."""
        return self.initial == "calculated" and self.causality != "independent"

    @property
    def continuous_state(self) -> bool:
        """Whether it is a component of the state vector that flows."""
        return self.array == "y" and self.variability == "continuous"


@dataclass(frozen=True)
class Indicator:
    """An event indicator.

    Parameters
    ----------
    name : str
        After the edge whose guard it is in.
    meaning : str
        The comparison, and all its edges.
    shift : float
        How far behind the crossing it is zero.
    """

    name: str
    meaning: str
    shift: float


def variables_of(subject: Subject, *, exchange: bool) -> tuple[FmuVariable, ...]:
    """Return the variables of what is exported."""
    start, alone = subject.start, subject.alone
    found = [FmuVariable("time", "TIME", causality="independent", initial="", unit="s")]
    found += _inputs(subject)
    states = [each for each in _shown(subject, alone) if each.name not in subject.inputs]
    found += states
    first = 1 + len(subject.inputs)
    for k, each in enumerate(states, first):
        if each.continuous_state:
            unit = per_second(each.unit)
            found.append(FmuVariable(f"der({each.name})", "SLOPES", each.index, unit=unit, of=k))
    found.append(
        FmuVariable(
            "switches",
            "COUNT",
            causality="output",
            variability="discrete",
            meaning="edges taken since the start",
        )
    )
    for quantity in parameters_of(start, alone, WORDS):
        found += _parameter(quantity, alone)
    if exchange:
        found += [
            FmuVariable(each.name, "INDICATOR", k, meaning=each.meaning)
            for k, each in enumerate(indicators_of(start, alone))
        ]
    return tuple(_different(found))


def types_of(start: Problem) -> dict[str, tuple[str, ...]]:
    """Return the states of the elements by the name of their enumeration, one for each contact."""
    return {
        f"{contact.name} states": tuple(state.name for state in contact.chart.states)
        for contact in start.system.machines
    }


def _inputs(subject: Subject) -> Iterator[FmuVariable]:
    tables = subject.start.program.p[2]
    speed = per_second(subject.start.system.machines[0].chart.length)
    for k, name in enumerate(subject.inputs):
        velocity = subject.alone and name == "v"
        first, *_ = tables[2 * k + 1]
        yield FmuVariable(
            name,
            "INPUT",
            k,
            causality="input",
            initial="exact",
            start=first,
            unit=speed if velocity else "",
            meaning="velocity" if velocity else "",
        )


def _shown(subject: Subject, alone: bool) -> Iterator[FmuVariable]:
    """Yield the state vector, what is observed and the states of the elements."""
    start = subject.start
    layout, system = start.program.layout, start.system
    held = {name for each in system.sampled for name in each.updates}
    for each in outputs_of(start, alone, WORDS):
        shared = each.length is None
        # Of one friction the force is wanted; of a system also how its bodies move.
        wanted = shared and (each.place == "seen" or (each.place == "y" and not alone))
        causality = "output" if wanted else "local"
        for name, k in _elements(each, alone):
            start_value = each.values[k] if each.values else None
            made = FmuVariable(
                name, "SEEN", each.index + k, causality=causality, unit=each.unit,
                meaning=each.meaning,
            )  # fmt: skip
            if each.place == "seen":
                yield made
            elif each.place == "y":
                discrete = each.label in held or each.label.endswith(" held")
                yield FmuVariable(
                    name, "IN_BLOCK", each.index + k, "y", causality,
                    "discrete" if discrete else "continuous", "exact", start_value, each.unit,
                    each.meaning,
                )  # fmt: skip
            else:
                assert start_value is not None
                bank = layout.bank(each.index)
                yield FmuVariable(
                    name, "STATE", each.index + k, "mode", "local", "discrete", "exact",
                    start_value + 1.0, meaning="active state", kind=f"{bank.name} states",
                )  # fmt: skip


def _parameter(each: Quantity, alone: bool) -> Iterator[FmuVariable]:
    for name, k in _elements(each, alone):
        yield FmuVariable(
            name, "IN_BLOCK", each.index + k, each.place, "parameter", "fixed", "exact",
            each.values[k], each.unit, each.meaning,
        )  # fmt: skip


def _elements(each: Quantity, alone: bool) -> Iterator[tuple[str, int]]:
    """Yield the name and the number of each value of a quantity."""
    owner, dot, _ = each.label.rpartition(".")
    name = each.name
    if dot and not alone:
        owner = re.sub(r"\W+", "_", owner)
        name = f"{owner}.{name.removeprefix(f'{owner}_')}"
    if each.length is None:
        yield name, 0
    else:
        yield from ((f"{name}[{k + 1}]", k) for k in range(each.length))


def _different(found: list[FmuVariable]) -> Iterator[FmuVariable]:
    """Yield the variables, with numbers where two would have the same name."""
    taken: set[str] = set()
    for each in found:
        base, bracket, rest = each.name.partition("[")
        name, number = each.name, 1
        while name in taken:
            number += 1
            name = f"{base}_{number}{bracket}{rest}"
        taken.add(name)
        yield each if name == each.name else FmuVariable(**{**vars(each), "name": name})


# --------------------------------------------------------------------------- event indicators
def indicators_of(start: Problem, alone: bool) -> tuple[Indicator, ...]:
    """Return the event indicators: one for each comparison that may be watched."""
    plan, program = plan_of(start.system.assembly), start.program
    sizes = _sizes(start)
    edges: dict[object, list[tuple[str, str]]] = {}
    names: dict[object, str] = {}
    for bank in plan.read.banks:
        owner = "" if alone else re.sub(r"\W+", "_", bank.name) + "."
        for edge in bank.edges if not bank.periodic else ():
            for relation in comparisons(split(edge.guard)):
                edges.setdefault(relation, []).append((bank.name, edge.name))
                names.setdefault(relation, _free(f"{owner}margin.{edge.name}", names.values()))
    found = []
    for (relation, i), text in zip(plan.relations, program.relations, strict=True):
        owners = list(dict.fromkeys(edges.get(relation, ())))
        name = names.setdefault(relation, _free("margin.corner", names.values()))
        guards = ", ".join(edge for _, edge in owners)
        where = f"in the guard of {guards}" if owners else "where the flow has a corner or a jump"
        margin = plan.read.expanded(Binary("-", relation.left, relation.right))
        scale = min((sizes[each] for each in names_in(margin) if sizes.get(each)), default=1.0)
        element = "" if i is None else f"[{i + 1}]"
        found.append(Indicator(f"{name}{element}", f"{text}, {where}", BEHIND * scale))
    for k in range(min(len(program.surfaces.sign), MOST_SLIDING)):
        found += [
            Indicator(f"margin.{side}[{k + 1}]", "a slide ends", BEHIND)
            for side in ("leaves_upward", "leaves_downward")
        ]
    return tuple(found)


def _free(name: str, taken: Iterable[str]) -> str:
    """Return a name that is not taken yet."""
    numbered = (f"{name}_{number}" for number in itertools.count(2))
    used = {*taken}
    return next(each for each in itertools.chain([name], numbered) if each not in used)


def _sizes(start: Problem) -> Mapping[str, float]:
    """Return the smallest scale of each name of the state vector, and of the velocities."""
    sizes = scales_of_system(start.program).sizes
    return {name: min((u for u in row if u > 0.0), default=0.0) for name, row in sizes.items()}


def nominals_of(start: Problem) -> list[float]:
    """Return the scales of the state vector, 1 where there is none."""
    options = start.options
    return [u / (SHARE * options.rtol) or 1.0 for u in options.atol]
