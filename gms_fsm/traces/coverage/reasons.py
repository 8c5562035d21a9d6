"""Coverage in words: the scores, what was never taken, and why not."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping

from gms_fsm.charts.chart import Chart
from gms_fsm.foundation.quantities import in_words, wrapped
from gms_fsm.language import Condition, Relation, awaited
from gms_fsm.traces.coverage.counts import ChartCoverage, EdgeCoverage, Score
from gms_fsm.traces.coverage.decisions import Decision
from gms_fsm.traces.scope import clause_text, clause_unit


def lines(parts: Mapping[str, ChartCoverage], scores: Mapping[str, Score]) -> list[str]:
    """Return the scores of all charts, and for each one what is missing and why."""
    counts = {name: f"{score.seen} of {score.of}" for name, score in scores.items()}
    width = max(map(len, counts.values()))
    some = next(iter(parts.values()))
    found = list(wrapped(f"{some.runs} run{'s' * (some.runs != 1)} of {_whose(parts)}"))
    found += [
        f"{name:<8} {counts[name]:>{width}}   {math.floor(score.percent):>3} %"
        for name, score in scores.items()
    ]
    if some.watched < some.runs:
        of = "no run" if not some.watched else f"{some.watched} of {some.runs} runs"
        found.append(f"clauses and MC/DC: {of} kept rows, and only these know them")
    for name, part in parts.items():
        lead = f"{name}: " if name else ""
        for heading, items in (
            ("never taken", _never_taken(part)),
            ("never seen to decide", _undecided(part)),
        ):
            own = [line for item in items for line in wrapped(f"  {item}")]
            found += [f"{lead}{heading}:", *own] if own else []
    return found


def _whose(parts: Mapping[str, ChartCoverage]) -> str:
    """Name the charts, those of a system with their contacts."""
    return ", ".join(
        f"{name} ({u.chart.name})" if name else u.chart.name for name, u in parts.items()
    )


def _never_taken(part: ChartCoverage) -> Iterator[str]:
    entered = {each.name: any(each.seen) for each in part.states}
    for each in part.edges:
        if any(each.taken):
            continue
        where = f"{each.edge} from {each.source}"
        if not entered[each.source]:
            yield f"{where}: {each.source} was never entered"
        elif not each.asked:
            yield where
        else:
            yield from (f"{where}: {reason}" for reason in _reasons(part, each))


def _reasons(part: ChartCoverage, each: EdgeCoverage) -> Iterator[str]:
    """Yield why an edge that was asked for was never taken."""
    decision = part.decisions[each.edge]
    fulfilled = [vector for vector in each.asked if decision.holds(vector)]
    if fulfilled:
        rows = sum(sum(each.asked[vector]) for vector in fulfilled)
        yield f"its guard was true at {rows} row{'s' * (rows != 1)}; another edge went first"
        return
    false = {
        vector: [clause for clause in decision.clauses if not decision.holds(vector, clause)]
        for vector in each.asked
    }
    always = [
        clause
        for clause in decision.clauses
        if all(clause in missing for missing in false.values())
    ]
    for clause in always:
        close = _closest(part, each, decision, clause, [*false])
        where = f" while it was in {each.source}" if awaited(clause) else ""
        yield f"{_never(part.chart, clause)}{where}{close}"
    if always:
        return
    fewest = min(map(len, false.values()))
    nearest = {vector: missing for vector, missing in false.items() if len(missing) == fewest}
    if fewest > 1:
        yield f"its {len(decision.clauses)} clauses were never true together"
        return
    for clause in dict.fromkeys(missing[0] for missing in nearest.values()):
        own = [vector for vector, missing in nearest.items() if missing[0] == clause]
        held = _held(part.chart, (other for other in decision.clauses if other != clause))
        held += " true" * bool(awaited(clause))
        close = _closest(part, each, decision, clause, own)
        yield f"{_never(part.chart, clause)} while {held}{close}"


def _closest(
    part: ChartCoverage, each: EdgeCoverage, decision: Decision, clause: Condition, of: list[str]
) -> str:
    """Return how close a clause came to being true, if it is one comparison."""
    if not isinstance(clause, Relation) or awaited(clause) or not each.closest:
        return ""
    number = decision.comparisons.index(clause)
    least = min((each.closest[vector][number] for vector in of), default=math.inf)
    if not math.isfinite(least):
        return ""
    unit = clause_unit(part.chart, clause)
    return f" (closest: {in_words(-least, unit, 3)})" if least else " (closest: equal)"


def _undecided(part: ChartCoverage) -> Iterator[str]:
    """Yield which comparisons of edges that were taken never decided the guard alone."""
    if not part.watched:
        return
    for each in part.edges:
        decision = part.decisions[each.edge]
        if not any(each.taken) or not each.asked:
            continue
        where = f"{each.edge} from {each.source}"
        for number, comparison in enumerate(decision.comparisons):
            shown = decision.shown(each.asked, number)
            for side, seen in zip(("true", "false"), shown, strict=True):
                if not seen:
                    bit = "1" if side == "true" else "0"
                    ever = any(vector[number] == bit for vector in each.asked)
                    why = f" while {_rest(part.chart, decision, number)}" if ever else ""
                    yield f"{where}: {_never(part.chart, comparison, side)}{why}"


def _rest(chart: Chart, decision: Decision, number: int) -> str:
    """Return what has to hold besides a comparison, so that it decides."""
    plain = all(isinstance(clause, Relation) for clause in decision.clauses)
    others = [each for i, each in enumerate(decision.comparisons) if i != number]
    if not plain or not others:
        return "it decided"
    held = _held(chart, others)
    return held if awaited(others[0]) else f"{held} true"


def _never(chart: Chart, clause: Condition, side: str = "true") -> str:
    """Say that a clause was never true, or never false; an event comes or is missing."""
    if event := awaited(clause):
        return f"the event {event} {'never came' if side == 'true' else 'was never missing'}"
    return f"`{clause_text(chart, clause)}` was never {side}"


def _held(chart: Chart, clauses: Iterable[Condition]) -> str:
    """Say that clauses held, to stand before "true"; an event, which is the first, comes."""
    first, *others = clauses
    if event := awaited(first):
        came = f"the event {event} came"
        return f"{_held(chart, others)} true and {came}" if others else came
    texts = [f"`{clause_text(chart, each)}`" for each in (first, *others)]
    return f"{_listed(texts)} {'was' if len(texts) == 1 else 'were'}"


def _listed(words: list[str]) -> str:
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))
