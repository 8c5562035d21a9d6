"""Charts that are hard to draw: many edges, self-loops, long guards; and random ones."""

from __future__ import annotations

import random

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.charts.registry import registered
from gms_fsm.language import MATLAB_LIKE, spell


def every() -> list[tuple[str, str]]:
    """Return the names of all charts with their laws."""
    return [(name, law) for name, each in registered().items() for law in each.laws or ("",)]


CLAUSES = (
    "z - w * k > s * (1 + 0.5 * abs(v) / v_c)",
    "abs(v) <= v_c * (1 + k * z)",
    "z < 2 * s",
    "v_hi < v",
    "z * v > -0.25 * k * (s - w)",
    "(v > 0 or w > v_c)",
    "not (z <= -s and v > 0)",
)
FLOWS = ("0", "v - k * abs(v) * z / s", "-v")


def guard(rng: random.Random, length: int) -> str:
    """Return a guard of at least so many characters."""
    text = rng.choice(CLAUSES)
    while len(text) < length:
        text += " and " + rng.choice(CLAUSES)
    return text


def random_chart(
    seed: int, states: int, edges: int, *, loops: int = 0, longest: int = 60, least: int = 1
) -> Chart:
    """Return a chart with edges between any states, and loops at the last one."""
    rng = random.Random(seed)
    names = [f"state_{i + 1}" for i in range(states)]
    ends = [(rng.choice(names), rng.choice(names)) for _ in range(edges)]
    ends += [(names[-1], names[-1])] * loops
    return Chart(
        f"random chart {seed}",
        inputs=("v", "s"),
        variables=("z", "w"),
        parameters=("k", "v_c", "v_hi"),
        states=tuple(State(name, flow={"z": "v", "w": rng.choice(FLOWS)}) for name in names),
        transitions=tuple(
            Transition(
                f"edge_{k}",
                source,
                target,
                guard=guard(rng, rng.randint(least, longest)),
                actions={"z": "s * sgn(v)"} if rng.random() < 0.2 else {},
            )
            for k, (source, target) in enumerate(ends)
        ),
        outputs={"F": "k * z"},
    )


def any_chart(seed: int) -> Chart:
    """Return a chart of 1 to 12 states and 0 to 40 edges."""
    rng = random.Random(seed)
    return random_chart(
        seed, rng.randint(1, 12), rng.choice([rng.randint(0, 12), rng.randint(0, 40)]), longest=140
    )


MANY_EDGES = random_chart(1, 12, 40)
THREE_LOOPS = random_chart(2, 3, 4, loops=3)
LONG_GUARDS = random_chart(3, 3, 5, longest=150, least=120)

RING = Chart(
    "ring",
    inputs=("v", "s"),
    variables=("z",),
    states=tuple(State(f"state_{i}", flow={"z": "v"}) for i in range(15)),
    transitions=tuple(
        Transition(f"next_{i}", f"state_{i}", f"state_{(i + 1) % 15}", guard="z > s and v < 0.2")
        for i in range(15)
    ),
    outputs={"F": "z"},
)
THERE_AND_BACK = Chart(
    "ring with a way back",
    inputs=("v", "s"),
    variables=("z",),
    states=RING.states[:8],
    transitions=tuple(
        Transition(f"{way}_{i}", *ends, guard=f"abs(z) > s and v {sign} 0.1")
        for i in range(8)
        for way, sign, ends in (
            ("next", ">", (f"state_{i}", f"state_{(i + 1) % 8}")),
            ("back", "<", (f"state_{(i + 1) % 8}", f"state_{i}")),
        )
    ),
    outputs={"F": "z"},
)

THREE_STATES = Chart(
    name="three states, a self loop, entry, exit and actions",
    inputs=("v", "s"),
    variables=("z",),
    parameters=("k", "v_c", "v_hi"),
    states=(
        State("stick", flow={"z": "v"}, entry={"z": "0"}),
        State("creep", flow={"z": "v - k * abs(v) * z / s"}),
        State("slip", flow={"z": "0"}, exit={"z": "z / 2"}),
    ),
    transitions=(
        Transition("go", "stick", "creep", guard="abs(z) > 0.5 * s"),
        Transition(
            "tear", "creep", "slip", guard="abs(z) >= s and v > v_c", actions={"z": "s * sgn(v)"}
        ),
        Transition("back", "creep", "stick", guard="not v > v_c"),
        Transition(
            "arrest", "slip", "stick", guard="abs(v) <= v_c and (z > 0 or v > 0) and z < 2 * s"
        ),
        Transition("again", "slip", "slip", guard="v > v_hi and z < s", actions={"z": "s"}),
        Transition("jump", "stick", "slip", guard="v_hi < v < 2 * v_hi"),
    ),
    outputs={"F": "k * z"},
)

LONG_CLAUSE = " + ".join(f"k * abs(z - {i}) ** 2" for i in range(10)) + " >= s"
HOSTILE = Chart(
    name="größe & <b>]]></b> \"x\" 'y' \\N ; # ]",
    inputs=("v", "s"),
    variables=("z", "Δζ"),
    parameters=("k", "σ_2", "sigma_0", "v_ç"),
    states=(
        State("état", flow={"z": "v", "Δζ": "sigma_0 * v"}, entry={"z": "-1e-6"}),
        State("слип", flow={"z": "0", "Δζ": "min(v, 0) / 2e20"}),
    ),
    transitions=(
        Transition("länge", "état", "слип", guard=LONG_CLAUSE + " and v < v_ç and z > -Δζ"),
        Transition("zurück", "слип", "état", guard="v < 0 or z > s or not (z <= -s and v > 0)"),
    ),
    outputs={"F": "k * z + σ_2 * v"},
)


def texts_of(chart: Chart, state: str) -> dict[str, list[str]]:
    """Return what the box of a state must say, by the word that stands before it."""
    alone = len(chart.states) < 3 or any(each.outputs or each.locked for each in chart.states)
    shared = {
        v
        for v in chart.variables
        if len(chart.states) > 2 and len({chart.flows[each.name, v] for each in chart.states}) == 1
    }
    trees = {
        "entry": chart.assignments["entry", state],
        "during": {f"d{v}": chart.flows[state, v] for v in chart.variables if v not in shared},
        "force": {f: chart.forces[state, f] for f in chart.force_names if alone},
        "exit": chart.assignments["exit", state],
    }
    return {
        kind: [
            f"{name} = {spell(tree, MATLAB_LIKE)};"
            for name, tree in each.items()
            if tree is not None
        ]
        for kind, each in trees.items()
    }


def label_of(chart: Chart, edge: str, order: str) -> str:
    """Return what must stand at an edge: its order or number, guard and actions."""
    assigned = chart.assignments["action", edge].items()
    actions = " ".join(f"{name} = {spell(tree, MATLAB_LIKE)};" for name, tree in assigned)
    return order % chart.guard_text(edge) + (f" {{{actions}}}" if actions else "")
