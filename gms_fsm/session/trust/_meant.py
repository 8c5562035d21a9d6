"""What was probably not meant.

Mixed-up units (a stroke in metres with thresholds in micrometres, a v_c above every speed, a mass
in grams, a friction in millinewtons), and arrests that the clock could not resolve.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gms_fsm.charts.chart import Chart, Transition
from gms_fsm.charts.gms import TABLE_I
from gms_fsm.charts.parameters import FloatArray
from gms_fsm.foundation.quantities import in_words, of_rotation, per_second
from gms_fsm.language import Call, Name, Number, Relation, Value, clauses, evaluate, names_in
from gms_fsm.lowering.scales import scales_of
from gms_fsm.session.explain import holds, values_at
from gms_fsm.systems.models import Model, parameters_of
from gms_fsm.systems.system import System
from gms_fsm.traces.scope import parameter_values
from gms_fsm.traces.trace import Trace
from gms_fsm.traces.verdicts import Doubt

FAR = 1e4  # a stroke of more thresholds than this is worth a note
NEAR = 1e-2  # of the smallest threshold: smaller deflections are not near it
MOST_ROWS = 1000  # rows
GRAVITY = 9.81  # m/s^2
FRICTIONS = (1e-3, 1e2)  # of the weight: less and more are hardly meant


def meant(trace: Trace) -> Iterator[Doubt]:
    """Yield what about one contact hardly was meant, and arrests that the clock could not see."""
    whose = trace.which
    for text in (*_sizes(trace), *_weight(trace)):
        yield Doubt("units", "note", f"{whose}: {text}" if whose else text, (), whose)
    for times, text in _windows(trace):
        yield Doubt("window", "warning", f"{whose}: {text}" if whose else text, times, whose)


def unused(trace: Trace) -> Iterator[Doubt]:
    """Yield what is not used: values that nothing reads, bodies that nothing moves, events."""
    texts = [*_awaited(trace)]
    if trace.system is not None:
        texts += [*_unread(trace.system), *_idle(trace.system)]
    for text in texts:
        yield Doubt("unused", "note", text)


def _unread(system: System) -> Iterator[str]:
    read = system.assembly
    banks = [tree for bank in read.banks for tree in bank.means.values()]
    defined = [each.tree for each in read.definitions if each.tree is not None]
    trees = [*read.forces.values(), *read.inertias.values(), *read.flow.values(), *defined, *banks]
    names = {name for tree in trees for name in names_in(tree)}
    updates = {name: tree for each in read.updates.values() for name, tree in each.items()}
    for sampled in system.sampled:
        for name in sampled.updates:
            others = (names_in(tree) for other, tree in updates.items() if other != name)
            if name not in names.union(*others):
                yield (
                    f"nothing reads {name} of {sampled.name}, so that it acts on nothing; if it is "
                    f'a force, give it to a body: force = "{name}"'
                )


def _awaited(trace: Trace) -> Iterator[str]:
    """Yield the events that edges wait for, and nothing has sent."""
    machines = trace.what.system.machines
    emitted = {name for each in machines for edge in each.chart.transitions for name in edge.emit}
    for each in machines:
        taken = set(trace.contact(each.name).transitions.edge)
        waiting = [edge for edge in each.chart.transitions if edge.event not in ("", *emitted)]
        for event in dict.fromkeys(edge.event for edge in waiting):
            edges = [edge.name for edge in waiting if edge.event == event]
            if taken.isdisjoint(edges):
                wait = "waits" if len(edges) == 1 else "wait"
                yield (
                    f"nothing emits the event {event}, for which {', '.join(edges)} of {each.name} "
                    f"{wait}; it can come from outside: session.poke({{'{event}': 1}}), or "
                    f"send {event} in the debugger"
                )


def _idle(system: System) -> Iterator[str]:
    read = system.assembly
    rubbed = {name for bank in read.banks for each in bank.jacobian for name in each}
    for body in read.free:
        if read.forces[body.name] == Number(0.0) and body.name not in rubbed:
            yield (
                f"nothing acts on body {body.name}, which keeps its velocity: it has no force, "
                "spring or contact"
            )


def _weight(trace: Trace) -> Iterator[str]:
    """Compare the friction with the weight of the mass of a rig."""
    mass, curve = trace.rig.numbers.get("mass", 0.0), trace.model.stribeck
    friction = max(float(np.abs(trace.F).max()), 0.0 if curve is None else curve.F_s)
    if trace.system is not None or not mass or not friction:
        return
    ratio, (least, most) = friction / (GRAVITY * mass), FRICTIONS
    if least <= ratio <= most:
        return
    cure = f"if the mass is in g, give {mass / 1e3:g}" if ratio < least else "if F is in mN, give N"
    yield (
        f"a friction of {in_words(friction, 'N', 3)} is {ratio:.2g} times the weight of "
        f"{mass:g} kg; masses are in kg, forces in N: {cure}"
    )


def _sizes(trace: Trace) -> Iterator[str]:
    """Compare stroke, speed and deflections with the scales of the model."""
    model, scales = trace.model, scales_of(trace.model)
    length, speed = model.chart.length, per_second(model.chart.length)
    if not model.chart.variables:
        return
    name = model.chart.variables[0]
    least = np.array(scales.variables[name])
    thresholds = trace.s.min(axis=0) if "s" in model.chart.inputs else least
    if not len(trace) > 1 or not model.chart.transitions or not (thresholds > 0.0).all():
        return
    stroke, fastest = float(np.ptp(trace.x)), float(np.abs(trace.v).max())
    deflected = float(np.abs(trace.z / thresholds).max())
    if not len(trace.transitions):
        if 0.0 < fastest <= scales.speed:
            bound = "v_c" if "v_c" in model.values else "the smallest speed in a guard"
            yield (
                f"no transition: the speed stays below {bound} (largest |v| "
                f"{in_words(fastest, speed, 3)}, {bound} {in_words(scales.speed, speed, 3)})"
            )
        elif model.stribeck is not None and (model.weights == 1.0).all() and not _of_table_1(model):
            yield (
                f"no transition: an element breaks away at its weight times the Stribeck curve, "
                f"here {in_words(float(thresholds.min()), length, 3)} or more, because all weights "
                f"are 1 {length}/{model.chart.force}, as in Table I of the paper; give shares of "
                "the friction, which sum to 1, or weights"
            )
        elif 0.0 < deflected < NEAR:
            smallest = in_words(float(thresholds.min()), model.chart.unit(name), 3)
            yield (
                f"no transition: no element comes near its threshold (largest |{name}| is "
                f"{deflected:.2g} of it, the smallest threshold {smallest}); if this "
                f"is not intended, check the units of {_scaling(model)}motion ({length})"
            )
    elif stroke > FAR * (most := _largest(trace, thresholds)):
        times = f"{stroke / most:.2g} times"
        yield (
            f"the stroke of {in_words(stroke, length, 3)} is {times} the largest threshold: nearly "
            "all of it is gross sliding; if pre-sliding is intended, check the unit of the motion "
            f"({length})"
        )


def _largest(trace: Trace, thresholds: FloatArray) -> float:
    return float(trace.s.max() if "s" in trace.model.chart.inputs else thresholds.max())


def _of_table_1(model: Model) -> bool:
    stiffness = np.asarray(model.values.get("k", 0.0))
    return any(np.array_equal(stiffness, column.values["k"]) for column in TABLE_I.values())


def _scaling(model: Model) -> str:
    """Return the parameters that scale thresholds and forces, with their units."""
    units = {unit for each in ("N/m", "m/N") for unit in (each, of_rotation(each))}
    known = [each for each in parameters_of(model) if each.unit in units]
    return ", ".join(f"{each.name} ({each.unit})" for each in known) + (" and " if known else "")


def _windows(trace: Trace) -> Iterator[tuple[tuple[float, ...], str]]:
    """Search for windows such as |v| <= v_c that were crossed within one tick of the clock."""
    if trace.settings.get("events") != "located":
        return
    whole = trace.whole()
    t, v, chart = whole.t, whole.v, whole.model.chart
    for edge, bound in _velocity_windows(chart):
        missed = []
        for i in range(whole.n):
            try:
                c = float(evaluate(bound, parameter_values(whole.model, i)))
            except (KeyError, ArithmeticError, ValueError):
                continue  # it depends on more than parameters
            inside = whole.modes[:, i] == chart.state_index(edge.source)
            jumped = inside[:-1] & inside[1:] & (v[:-1] * v[1:] < 0.0)
            jumped &= (np.abs(v[:-1]) > c) & (np.abs(v[1:]) > c)
            for row in (np.flatnonzero(jumped) + 1)[:MOST_ROWS].tolist():
                still = values_at(whole, row, i) | {"v": 0.0}
                if (curve := whole.model.stribeck) is not None:  # under the load of that row
                    still["s"] *= curve.F_s / float(curve(v[row]))
                if holds(chart.guards[edge.name], still):
                    missed.append(float(t[row]))
        if missed:
            yield (
                tuple(sorted(missed)),
                f"{edge.name} could not be detected {len(missed)} times, first at t = "
                f"{min(missed):.9g} s: v passes its window within one tick of the clock; use a "
                "larger v_c, or let the run start nearer to t = 0",
            )


def _velocity_windows(chart: Chart) -> Iterator[tuple[Transition, Value]]:
    for edge in chart.transitions:
        for part in clauses(chart.guards[edge.name]):
            match part:
                case Relation("<" | "<=", Call("abs", (Name("v"),)), bound):
                    yield edge, bound
