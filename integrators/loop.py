"""The outer loop as a function that runs until the next event and then returns.

Evaluate the guards of every machine, fire, and repeat until no edge is enabled; then freeze the
states and let the kernel advance to the next stop. The whole state is kept in arrays, so that the
loop can return at every event and be called again: Python's generator (`integrators.hybrid`) passes
each event to its caller, the compiled engine (`record`) writes it into columns.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

from integrators.advance import (
    CROSSED,
    FULL,
    NOT_FINITE,
    REACHED,
    TOO_SMALL,
    Output,
    RunPlan,
    advance,
    knot_after,
    put_row,
    raise_floor,
    tick_at,
)
from integrators.crossings import (
    FOR_A_GUARD,
    FOR_A_SIGN,
    JUST_BELOW,
    MANY,
    Watched,
    aimed_step,
    listed,
)
from integrators.sliding import Functions, Held, Sliding, arm_on, margins_on, other_mode
from integrators.step_size import INFINITY, error_norm, starting_step
from integrators.steps import ArcMotion, Now, Scratch, Vector, time_of
from integrators.switching.jolts import (
    ALONE,
    IMPULSE,
    JUMPED,
    LET_GO,
    arrived,
    cut,
    jolted,
    marked,
    only_let_go,
    only_new,
)
from integrators.switching.machines import Machines, Switching
from integrators.switching.sliding_bounds import (
    crossed,
    entangled,
    leave,
    let_go,
    let_go_in_time,
    look_back,
    own_edge,
    repels,
    seize,
)

__all__ = [
    "MOST_SWITCHES",
    "Buffers",
    "Machines",
    "Memory",
    "Switching",
    "run_to_event",
]

MOST_SWITCHES = 100  # of one machine, or of one relation, without progress
# Switches make no progress if successive ones are closer than this part of the time itself, or of
# the run's end (at the start of a run nothing is small compared with the time itself),
CLOCK_STANDS = 1e-9
END_STANDS = 2.0**-53
# ... or closer than this, while the state moves by less than a tenth of its tolerance per switch.
CLOCK_CRAWLS = 1e-6
STATE_STANDS = 0.1

SHORTER = 0.8  # of the step before a tick: the interval's steps are then more alike

# Events (TOO_SMALL and NOT_FINITE are the kernel's).
ROWS, FIRING, FIRED, STOPPED, DONE, SLID = 10, 11, 12, 13, 14, 15
MACHINE_LIVELOCK, RELATION_LIVELOCK, ADVANCE, TOO_MANY_STEPS, PAUSED = 16, 17, 18, 19, 20
REFUSED = 22  # an edge would take a velocity that has jumped, and there is no other
ENTANGLED = 23  # machines slide on surfaces that bear on each other
NOTHING = -1  # no event yet
# Phases.
START, ASK, PICK, FIRE, SETTLED, BEGIN, ARC, AFTER, JUMPING, FINISH, END = range(11)


@dataclass(slots=True, eq=False)
class Memory:
    """What the loop stores between two calls."""

    phase: int
    microstep: int
    machine: int  # whose edge is taken
    edge: int
    fired_one: bool  # since the machines were asked last
    fresh: bool  # whether something has switched or jumped since the last arc began
    status: int  # why the kernel returned
    jump: int  # the next one in the plan
    active: int  # how many relations are watched
    taken: int  # rows that the caller has taken
    new_arc: bool  # whether a foreign solver must begin anew
    hold: int  # what ticks of the discrete machines that have been asked, as bits
    edges: list[int]  # the enabled edge of each machine, or -1
    switches: list[int]  # firings of each machine since the time `Now.anchor`
    changes: list[int]  # changes of each relation since that time
    anchor: Vector  # the state at that time
    heard: list[int]  # what each machine has answered, as bits (see `cut`)
    was: Vector  # velocities before this instant, where locks make them matter; else empty
    jolt: list[int]  # JUMPED or LET_GO for each machine whose velocity has changed at once


class Buffers(NamedTuple):
    """Everything that one run needs besides the system's functions; changed in place."""

    plan: RunPlan
    now: Now
    memory: Memory
    relations: Watched
    sliding: Sliding
    out: Output
    scratch: Scratch


# Long because each phase is one branch: the sequence is read in one place.
def run_to_event(
    functions: Functions, switch: Switching, motion: ArcMotion, b: Buffers, most_steps: int
) -> int:
    """Run until the next event."""
    plan, now, memory = b.plan, b.now, b.memory
    relations, sliding, scratch = b.relations, b.sliding, b.scratch
    out, p = b.out, functions.p
    on = Held(functions, now.held, sliding)
    while True:
        if out.row > memory.taken:
            return ROWS
        phase, event = memory.phase, NOTHING
        if phase == ASK:
            if plan.lasting > 0:
                switch.tick(plan.lasting, now.t, now.y, now.mode, p)
            left = _ask(switch, now, memory, sliding, p)
            # An edge of the other mode is enabled: go there first.
            if len(sliding.surfaces.rise) > 0 and left >= 0:
                leave(on, now, relations, left)
                return SLID
            memory.machine = -1
            memory.fired_one = False
            memory.phase = PICK
            moved, whole = marked(memory.jolt, LET_GO), True
            if len(plan.kinds) > 0:
                only_new(plan.kinds, memory.edges, memory.heard)
            if len(memory.was) > 0:
                refused = only_let_go(plan.located, memory.edges, memory.jolt)
                if refused >= 0:
                    _refuse(memory, refused, -2 - memory.edges[refused])
            if len(plan.kinds) > 0:
                whole = cut(plan.located, plan.kinds, memory.edges, memory.heard, moved)
            if plan.events > 0 and whole:
                switch.tick(plan.events, now.t, now.y, now.mode, p)
        elif phase == PICK:
            event = _pick(plan, memory)
        elif phase == FIRE:
            _act(switch, on, plan, now, memory, relations)
            event = _fired(plan, now, memory, scratch)
        elif phase == SETTLED:
            if now.t >= now.pause:
                return PAUSED
            if now.seen < now.t:  # what is before the jump has switched
                memory.phase = JUMPING
            elif memory.hold > 0:  # discrete machines have fired: what they give out is held now
                switch.tick(memory.hold, now.t, now.y, now.mode, p)
                memory.hold = 0
                memory.fresh = True
                event = _jump(now, memory, out)
            else:
                if plan.located:
                    for i in range(len(memory.jolt)):
                        memory.jolt[i] = 0
                _choose_stop(plan, now, memory)
            if event == NOTHING and plan.located and memory.phase == BEGIN:
                event = _rearm(plan, on, now, relations, memory)
        elif phase == BEGIN:
            event = _begin_arc(motion, plan, now, relations, out, scratch, memory)
        elif phase == ARC:
            steps = _steps_ahead(plan, out, most_steps)
            if steps > 0 and not plan.foreign:
                w = listed(relations, memory.active)
                memory.status = advance(motion, plan, now, w, out, scratch, steps)
            event = _flowed(plan, memory, steps)
        elif phase == AFTER:
            often = False
            if memory.status == CROSSED:
                w = listed(relations, memory.active)
                often = _often_changed(motion, plan, now, w, sliding, memory, scratch)
                let_go_in_time(on, now, relations)
            if len(memory.was) > 0 and memory.status in (REACHED, CROSSED, FULL):
                arrived(switch, plan, now, memory.was, memory.jolt, memory.status == CROSSED, p)
            event = _end_arc(plan, now, memory, often)
        elif phase == JUMPING:
            look_back(on, now, relations)
            now.t = plan.jumps[memory.jump]
            now.seen = INFINITY
            if plan.ticks[memory.jump] > 0:
                switch.tick(plan.ticks[memory.jump], now.t, now.y, now.mode, p)
                _make_due(plan, memory)
            let_go(on, now, relations)
            if len(memory.was) > 0:
                jolted(switch, now, memory.was, memory.jolt, p)
            event = _jump(now, memory, out)
        elif phase == START:
            if len(plan.jumps) > 0 and plan.jumps[0] <= now.t:
                switch.tick(plan.ticks[0], now.t, now.y, now.mode, p)
                _make_due(plan, memory)
            if len(memory.was) > 0:
                jolted(switch, now, memory.was, memory.jolt, p)
                for i in range(len(memory.jolt)):
                    if memory.jolt[i] == LET_GO:  # a start in a lock has been checked
                        memory.jolt[i] = 0
            _start(plan, now, memory, out)
        elif phase == FINISH:
            _finish(now, memory, out)
        else:
            return DONE
        if event != NOTHING:
            return event


# --------------------------------------------------------------------------- one helper per phase
# They take only what they need, not all the buffers: every array is passed separately in a call.
def _start(plan: RunPlan, now: Now, memory: Memory, out: Output) -> None:
    memory.phase = ASK
    memory.fresh = True
    raise_floor(plan.control, now)
    if out.every_step:
        put_row(out, now.t, now.y)


def _ask(switch: Switching, now: Now, memory: Memory, sliding: Sliding, p: Any) -> int:
    """Fill the enabled edges; return the surface of a machine whose other mode has one, or -1."""
    surfaces, which, edges = sliding.surfaces, sliding.which, memory.edges
    t, y, mode = time_of(now), now.y, now.mode
    for i in surfaces.machine:
        if i >= 0:
            edges[i] = -1
    if len(surfaces.rise) > 0:
        for c in range(sliding.count):
            i = surfaces.machine[which[c]]
            if i >= 0:
                edges[i] = own_edge(surfaces, which[c], mode[i])
    switch.ask(t, y, mode, p, memory.jolt, edges)
    left = -1
    if len(surfaces.rise) > 0:
        for c in range(sliding.count):
            k = which[c]
            i = surfaces.machine[k]
            if i >= 0 and edges[i] < 0:
                kept = mode[i]
                mode[i] = other_mode(surfaces, k, kept)
                for j in range(len(edges)):
                    sliding.edges[j] = -1
                sliding.edges[i] = own_edge(surfaces, k, mode[i])
                switch.ask(t, y, mode, p, memory.jolt, sliding.edges)
                mode[i] = kept
                if sliding.edges[i] >= 0:
                    left = k
    return left


def _refuse(memory: Memory, machine: int, edge: int) -> None:
    """End the run at an edge that is refused."""
    memory.machine = machine
    memory.edge = edge
    memory.phase = AFTER
    memory.status = REFUSED


def _act(
    switch: Switching, on: Held, plan: RunPlan, now: Now, memory: Memory, relations: Watched
) -> None:
    """Take an edge."""
    edge, machine, p = memory.edge, memory.machine, on.functions.p
    look_back(on, now, relations)
    switch.act(edge, machine, time_of(now), now.y, now.mode, p)
    let_go(on, now, relations)
    crossed(on.sliding, machine, edge)
    if len(memory.was) > 0 and len(plan.kinds) > 0 and plan.kinds[edge] & ALONE == IMPULSE:
        jolted(switch, now, memory.was, memory.jolt, p)


def _pick(plan: RunPlan, memory: Memory) -> int:
    """Find the next machine with an enabled edge."""
    edges = memory.edges
    i = memory.machine + 1
    while i < len(edges) and edges[i] < 0:
        i += 1
    if i < len(edges):
        memory.machine = i
        memory.edge = edges[i]
        memory.phase = FIRE
        return FIRING
    again = plan.located or marked(memory.jolt, LET_GO) or marked(memory.heard, 0)
    memory.phase = ASK if memory.fired_one and again else SETTLED
    return NOTHING


def _fired(plan: RunPlan, now: Now, memory: Memory, scratch: Scratch) -> int:
    """Count the edge that was just taken."""
    i = memory.machine
    memory.microstep += 1
    memory.fired_one = True
    memory.fresh = True
    memory.phase = PICK
    if memory.jolt[i] == LET_GO:
        memory.jolt[i] = JUMPED if plan.located else 0
    _reset_if_advanced(now, memory)
    memory.switches[i] += 1
    if memory.switches[i] >= MOST_SWITCHES and _no_progress(plan, now, memory, scratch):
        memory.phase = AFTER
        memory.status = MACHINE_LIVELOCK
    return FIRED


def _choose_stop(plan: RunPlan, now: Now, memory: Memory) -> None:
    """Choose the next stop once no edge is enabled: the next jump, or the end."""
    t, jumps = now.t, plan.jumps
    if t >= plan.t_end:
        memory.phase = FINISH
        return
    while memory.jump < len(jumps) and jumps[memory.jump] <= t:
        memory.jump += 1
    now.t_stop = plan.t_end
    if memory.jump < len(jumps):
        # A step that ends on a jump would see the value after it: it is asked one clock tick before
        # its end. At a tick, or if steps are not ours, it ends there.
        now.seen = plan.before_jumps[memory.jump]
        reached = plan.ticks[memory.jump] == 0 and not plan.foreign
        now.t_stop = min(now.t_stop, jumps[memory.jump] if reached else now.seen)
    memory.status = FULL
    memory.phase = BEGIN


def _rearm(plan: RunPlan, on: Held, now: Now, relations: Watched, memory: Memory) -> int:
    """Freeze signs, choose what to watch and to slide on, store the truth values watched."""
    functions, sliding = on.functions, on.sliding
    surfaces, watch, p = sliding.surfaces, relations.watch, functions.p
    t, y = now.t, now.y
    mode, held = now.mode, now.held
    for a in range(memory.active):
        watch[relations.room[a]] = 0
    arm_on(on, t, y, mode, watch)
    for k in range(len(surfaces.sign)):
        if surfaces.machine[k] >= 0 and (sliding.flags[k] == 1 or sliding.arrived[k] == 1):
            watch[surfaces.above[k]] |= FOR_A_SIGN
    w = _list(relations, memory)
    functions.margins(t, y, mode, p, watch, w.start)
    slid = False
    if len(surfaces.sign) > 0:
        begins = t == plan.control.origin and sliding.count == 0
        if begins and repels(on, now, w):
            memory.phase, memory.status = AFTER, ENTANGLED
            return NOTHING
        slid = seize(on, now, w)
        functions.follow(t, y, mode, held, p)
        count = sliding.count
        if len(surfaces.rise) > 0 and count > 1 and entangled(on, t, y, mode):
            memory.phase, memory.status = AFTER, ENTANGLED
            return NOTHING
        if count > 0:
            first = len(watch) - 2 * len(sliding.sigma)
            for c in range(count):
                k = sliding.which[c]
                watch[surfaces.above[k]] = watch[surfaces.at_least[k]] = 0
                watch[first + 2 * c] = watch[first + 2 * c + 1] = 1
            w = _list(relations, memory)
            margins_on(t, y, mode, on, watch, w.start)
    for k in range(len(surfaces.sign)):
        if surfaces.machine[k] < 0:
            w.above[surfaces.above[k]], w.above[surfaces.at_least[k]] = 0.0, JUST_BELOW
    undefined = False  # a comparison that is NaN would never turn true
    for r in w.active:
        g = w.start[r]
        w.truth[r] = g > w.above[r]
        undefined = undefined or g != g
    for k in range(len(surfaces.sign)):  # one met exactly is left on the side of its sign
        sign = held[surfaces.sign[k]] if surfaces.machine[k] < 0 else 0.0
        if watch[surfaces.above[k]] and sign != 0.0:
            for r in (surfaces.above[k], surfaces.at_least[k]):
                # A guard that is false on the surface itself turns true just after it.
                if not watch[r] & FOR_A_GUARD or w.start[r] != 0.0:
                    w.truth[r] = sign > 0.0
                    # A difference of large velocities may stay 0 for some ticks.
                    if w.start[r] == 0.0:
                        w.above[r] = JUST_BELOW if sign > 0.0 else 0.0
    if undefined:
        memory.phase = AFTER
        memory.status = NOT_FINITE
    elif slid:  # y is on the surface now: comparisons with it must be evaluated again
        memory.phase = ASK
        return SLID
    return NOTHING


def _list(relations: Watched, memory: Memory) -> Watched:
    """List the flagged relations."""
    active = 0
    for r in range(len(relations.watch)):
        if relations.watch[r]:
            relations.room[active] = r
            active += 1
    memory.active = active
    return listed(relations, active)


def _begin_arc(
    motion: ArcMotion,
    plan: RunPlan,
    now: Now,
    relations: Watched,
    out: Output,
    scratch: Scratch,
    memory: Memory,
) -> int:
    """Compute the slope and choose the first step after a switch or a jump."""
    control = plan.control
    memory.phase = ARC
    if plan.located or memory.fresh:
        memory.new_arc = True
        memory.fresh = False
        if not plan.foreign:
            motion.flow(now.t, now.y, now.mode, now.held, motion.p, now.f)
            # Without location the solver knows nothing of switches: it keeps its step.
            if control.step <= 0.0 and (plan.located or now.h <= 0.0):
                now.error_before = 1.0
                first = _first_step(motion, plan, now, relations, out, scratch, memory)
                now.h = max(first, tick_at(now.t))  # a knot may be a few ticks away
    return ADVANCE if plan.foreign else NOTHING


def _first_step(
    motion: ArcMotion,
    plan: RunPlan,
    now: Now,
    relations: Watched,
    out: Output,
    scratch: Scratch,
    memory: Memory,
) -> float:
    """Return the first step of an arc: to the next change if that is near, and many are watched.

    Where something ticked and nothing switched it is little shorter than the steps before: a
    controller changes little, and one that changes much, or a signal that jumps at the tick, costs
    a rejected step.
    """
    if len(relations.truth) > MANY and memory.active > MANY and now.h > 0.0:
        aimed = aimed_step(motion, now, 0.1 * now.h, listed(relations, memory.active))
        if aimed < 0.5 * now.h:
            return aimed
    last = memory.jump - 1
    ticked = last >= 0 and plan.jumps[last] == now.t and plan.ticks[last] > 0
    if ticked and memory.microstep == 0 and now.h > 0.0:
        return SHORTER * now.h
    knot, order = knot_after(plan, now, out), plan.method.error_order
    return starting_step(motion, order, plan.control, now, knot, scratch)


def _steps_ahead(plan: RunPlan, out: Output, most_steps: int) -> int:
    """Return how many steps may be taken in one call."""
    left = plan.max_steps - out.steps
    return min(most_steps, left) if plan.located else min(1, left)


def _flowed(plan: RunPlan, memory: Memory, steps: int) -> int:
    """Return whether the arc continues; a foreign solver has already taken its steps."""
    memory.microstep = 0
    if steps <= 0:
        return TOO_MANY_STEPS
    if memory.status != FULL or not plan.located:
        memory.phase = AFTER
        return NOTHING
    return ADVANCE if plan.foreign else ROWS


def _end_arc(plan: RunPlan, now: Now, memory: Memory, often: bool) -> int:
    """Return the reason for the end of the arc."""
    status = memory.status
    if status in (TOO_SMALL, NOT_FINITE, MACHINE_LIVELOCK, REFUSED, ENTANGLED):
        return status
    memory.phase = ASK
    if status == REACHED and (now.t < plan.t_end or now.seen < now.t):
        memory.phase = JUMPING
        return STOPPED
    if status == FULL and not plan.located:
        return ROWS  # possibly none; yields control to the caller
    if status == CROSSED:
        return RELATION_LIVELOCK if often else STOPPED
    return NOTHING


def _make_due(plan: RunPlan, memory: Memory) -> None:
    """Let discrete machines be asked at the tick that has just come."""
    bits = plan.ticks[memory.jump]
    for i in range(len(memory.heard)):
        if plan.discrete[i] & bits > 0:
            memory.heard[i] = 0
            memory.hold |= plan.discrete[i]


def _jump(now: Now, memory: Memory, out: Output) -> int:
    """Pass a jump of the flow, or of what discrete machines give out."""
    memory.phase = ASK
    if out.every_step:
        put_row(out, now.t, now.y)
    return STOPPED


def _finish(now: Now, memory: Memory, out: Output) -> None:
    """Write the rows requested for the end itself."""
    memory.phase = END
    t = now.t
    while out.next_time < len(out.times) and out.times[out.next_time] <= t:
        put_row(out, out.times[out.next_time], now.y)
        out.next_time += 1


# --------------------------------------------------------------------------- progress
def _reset_if_advanced(now: Now, memory: Memory) -> None:
    """Restart the count of switches if time has advanced since the last one."""
    t = now.t
    if t - now.switched > max(CLOCK_CRAWLS * abs(t), END_STANDS * now.latest):
        _reset_counts(now, memory)
    now.switched = t


def _reset_counts(now: Now, memory: Memory) -> None:
    now.anchor = now.t
    for j in range(len(now.y)):
        memory.anchor[j] = now.y[j]
    for i in range(len(memory.switches)):
        memory.switches[i] = 0
    for r in range(len(memory.changes)):
        memory.changes[r] = 0


def _no_progress(plan: RunPlan, now: Now, memory: Memory, scratch: Scratch) -> bool:
    """Return whether the counted switches made no progress; otherwise restart the count here."""
    y, anchor, moved = now.y, memory.anchor, scratch.error
    t, elapsed = now.t, now.t - now.anchor
    stands = elapsed <= MOST_SWITCHES * max(CLOCK_STANDS * abs(t), END_STANDS * now.latest)
    if not stands and elapsed <= MOST_SWITCHES * CLOCK_CRAWLS * abs(t):
        for j in range(len(y)):
            moved[j] = y[j] - anchor[j]
        distance = error_norm(moved, 1.0, y, anchor, plan.control.rtol, now.floor)
        stands = distance <= MOST_SWITCHES * STATE_STANDS
    if not stands:
        _reset_counts(now, memory)
    return stands


def _often_changed(
    motion: ArcMotion,
    plan: RunPlan,
    now: Now,
    w: Watched,
    sliding: Sliding,
    memory: Memory,
    scratch: Scratch,
) -> bool:
    """Count the relations that have just changed; return whether one has changed too often."""
    changes, probe, surfaces = memory.changes, w.search.probe, sliding.surfaces
    _reset_if_advanced(now, memory)
    t = time_of(now)
    motion.margins(t, now.y, now.mode, motion.p, w.watch, probe)
    often = False
    for r in w.active:
        g = probe[r]
        if (g > w.above[r]) != w.truth[r]:
            changes[r] += 1
            often = often or changes[r] >= MOST_SWITCHES
            w.changed[r] = 1
        else:
            w.changed[r] = 0
    for k in range(len(surfaces.sign)):
        above, at_least = surfaces.above[k], surfaces.at_least[k]
        if surfaces.machine[k] < 0 and w.watch[above] and (w.changed[above] or w.changed[at_least]):
            sliding.arrived[k] = 1
    return often and _no_progress(plan, now, memory, scratch)
