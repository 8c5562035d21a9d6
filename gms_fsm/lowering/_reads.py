"""What each function of a program reads, derived from the trees of its plan.

Names are those of the text, `Names.local`. A variable that is assigned counts as read.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal as OneOf

from gms_fsm.language import comparisons, split
from gms_fsm.lowering._names import computed_names
from gms_fsm.lowering._plan import Flow, Gradient, Input, Plan, RoughCall, both_sides

__all__ = ["Head", "Signs", "head_of", "of_act", "of_arm", "of_element", "of_flow", "of_gradient"]
__all__ += ["of_margins", "of_normal", "of_observe", "of_switch"]

# Where a rough call takes its sign from: frozen, evaluated live, or given; each given sign may
# specify that it is to be evaluated live.
Signs = OneOf["held", "live", "given"]
Reads = frozenset[str]


@dataclass(frozen=True)
class Head:
    """The values that a function reads before its body.

    Parameters
    ----------
    arguments : bool
        Whether it reads any arguments.
    shared, own : tuple of (str, int)
        Names of the numbers, and their positions.
    size : bool
        Whether it reads the number of elements.
    inputs : tuple of Input
        The signals that it evaluates.
    x, v : bool
        Whether it reads these from the state vector.
    curve : bool
        Whether it computes S.
    """

    arguments: bool
    shared: tuple[tuple[str, int], ...]
    own: tuple[tuple[str, int], ...]
    size: bool
    inputs: tuple[Input, ...]
    x: bool
    v: bool
    curve: bool


def head_of(plan: Plan, reads: Reads, signs: Signs) -> Head:
    """Return the values that a function reads before its body.

    Parameters
    ----------
    plan : Plan
        The plan of the program.
    reads : frozenset of str
        The names that its body reads.
    signs : {"held", "live", "given"}
        Where the rough calls in signals take their signs from.

    Returns
    -------
    Head
        Everything needed to compute these names.
    """
    curve = plan.curve is not None and "S" in reads
    if plan.curve is not None and curve:
        reads |= computed_names(plan.curve)
    inputs = tuple(each for each in plan.inputs if each.name in reads)
    reads = reads.union(*(_of_input(plan, each, signs) for each in inputs))
    shared = tuple((name, j) for j, name in enumerate(plan.names.shared) if name in reads)
    own = tuple((name, j) for j, name in enumerate(plan.names.own) if name in reads)
    return Head(
        arguments=bool(shared or own or reads & {"n", "tables"}),
        shared=shared,
        own=own,
        size="n" in reads,
        inputs=inputs,
        x="x" in reads,
        v="v" in reads and not plan.prescribed,
        curve=curve,
    )


def of_element(plan: Plan, reads: Reads) -> tuple[str, ...]:
    """Return the variables, and possibly ``s``, that a loop reading this must assign first."""
    local = plan.names.local
    variables = tuple(name for name in plan.variables if local[name] in reads)
    return variables + (("s",) if "s" in reads else ())


def _with_element(plan: Plan, reads: Reads) -> Reads:
    """Return what is read if the values of an element are assigned first."""
    first = of_element(plan, reads)
    places = (plan.layout.y.text_names(name) for name in first if name != "s")
    return reads.union(*places, {"weight", "S"} if "s" in first else ())


def _of_loop(plan: Plan, reads: Reads) -> Reads:
    """Return what a loop over the elements reads."""
    return _with_element(plan, reads) | {"n"}


def of_switch(plan: Plan) -> Reads:
    """Return what ``switch`` reads."""
    return _of_loop(plan, plan.names.read_by(*(edge.guard for edge in plan.edges)))


def of_act(plan: Plan) -> Reads:
    """Return what ``act`` reads."""
    reads: Reads = frozenset()
    for variable, value in (step for edge in plan.edges for step in edge.steps):
        reads |= plan.names.read_by(value) | {plan.names.local[variable]}
        reads |= plan.layout.y.text_names(variable)
    return _with_element(plan, reads)


def of_flow(plan: Plan, signs: Signs) -> Reads:
    """Return what ``flow`` and ``flow_live`` read."""
    reads = _of_rates(plan, plan.flow, signs) | {"v"}
    reads = reads.union(*(plan.layout.y.text_names(name) for name in plan.variables))
    if plan.flow.acceleration is not None:
        reads |= plan.names.read_by(plan.flow.acceleration) | {"sigma_2"}
    return _of_loop(plan, reads)


def of_observe(plan: Plan) -> Reads:
    """Return what ``observe`` reads."""
    reads = _of_rates(plan, plan.observed, "given") | {"v", "sigma_2"}
    if plan.threshold:
        reads |= {"s"}
    elif plan.curve is not None:
        reads |= {"weight", "S"}
    return _of_loop(plan, reads)


def of_normal(plan: Plan) -> Reads:
    """Return what ``normal`` reads."""
    reads = (_with_element(plan, of_gradient(plan, each)) for each in plan.gradients)
    return frozenset({"n"} if plan.gradients else ()).union(*reads)


def of_gradient(plan: Plan, gradient: Gradient) -> Reads:
    """Return what the derivatives for one surface read."""
    trees = [*gradient.by_state.values(), *gradient.by_signal.values()]
    trees += [each for each in (gradient.by_v, gradient.by_s, gradient.by_t) if each is not None]
    reads = plan.names.read_by(*trees)
    reads = reads.union(*(plan.layout.y.text_names(name) for name in gradient.by_state))
    if gradient.by_s is not None and plan.curve_slope is not None:
        reads |= computed_names(plan.curve_slope) | {"weight"}
    moving = {*gradient.by_signal, *({"v"} if gradient.by_speed and plan.prescribed else ())}
    for each in plan.inputs:
        if each.name in moving:
            reads |= {"t", "tables"} if each.slope is None else computed_names(each.slope)
    return reads


def of_arm(plan: Plan) -> Reads:
    """Return what ``arm`` reads."""
    reads = plan.names.read_by(*plan.held.shared, *plan.held.own)
    reads = reads.union(*(plan.held.text_names(u) for u in plan.held.own))
    watched = [*plan.always]
    for edge in plan.edges:
        found = comparisons(split(edge.guard))
        reads |= plan.names.read_by(*(side for r in found for side in (r.left, r.right)))
        watched += found
    watched += [r for rough in plan.rough.values() for u in rough for r in both_sides(u)]
    reads = reads.union(*(plan.relations.text_names(r) for r in watched))
    return _of_loop(plan, reads) if plan.edges or any(plan.rough.values()) else reads


def of_margins(plan: Plan) -> Reads:
    """Return what ``margins`` reads."""
    reads: Reads = frozenset()
    for each in (*plan.relations.shared, *plan.relations.own):
        reads |= plan.names.read_by(each.left, each.right) | plan.relations.text_names(each)
    return _of_loop(plan, reads) if plan.relations.own else reads


def _of_rates(plan: Plan, flow: Flow, signs: Signs) -> Reads:
    """Return what rates and forces, and the rough calls before them, read."""
    calls = [*flow.calls, *(call for state in flow.states for call in state.calls)]
    trees = [tree for state in flow.states for tree in state.rates.values()]
    forces = [flow.force, *(state.force for state in flow.states)]
    trees += [force for force in forces if force is not None]
    return plan.names.read_by(*trees).union(*(_of_call(plan, call, signs) for call in calls))


def _of_call(plan: Plan, call: RoughCall, signs: Signs) -> Reads:
    """Return what a rough call reads; for a frozen sgn, only the sign."""
    place = frozenset() if signs == "live" else plan.held.text_names(call.turning)
    if signs == "held" and call.call.function == "sgn":
        return place
    return place | plan.names.read_by(call.call)


def _of_input(plan: Plan, signal: Input, signs: Signs) -> Reads:
    """Return what the value of a signal reads."""
    if signal.formula is None:
        return frozenset({"t", "tables"} if signal.tabled else {"t"})
    reads = (_of_call(plan, call, signs) for call in signal.calls)
    return computed_names(signal.formula).union(*reads)
