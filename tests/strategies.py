"""The strategies of hypothesis: charts of any parts, and models, rigs and settings that run."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import strategies as st

from gms_fsm import (
    GMS,
    Chart,
    ChartModel,
    GMSParameters,
    Parameter,
    Prescribed,
    PulledSlider,
    Slider,
    State,
    Stribeck,
    Transition,
)

__all__ = [
    "banks",
    "chart_models",
    "charts",
    "moves",
    "options",
    "pairs_on_a_surface",
    "provable_charts",
    "ramps",
    "rigs",
    "rounded",
    "signals",
]

TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
VALUES = ("0", "k * z", "-k", "exp(-v**2) + σ_0", "F_c * sgn(v)", "1e-300 * w")
GUARDS = ("True", "v > 0", "z >= σ_0 or abs(w) < k", "after(0.1)", "not w < 1")
NAMES = ("stuck", "slip", "Schlupf", "αβ", "x1_")


@st.composite
def charts(
    draw: st.DrawFn,
    *,
    locks: bool = True,
    forces: tuple[str, ...] = ("F < -k and z >= σ_0",),
    plain: bool = False,
) -> Chart:
    """Return a chart.

    Parameters
    ----------
    draw : callable
        Hypothesis's.
    locks : bool
        Whether states may lock the contact, and edges may set the velocity.
    forces : tuple of str
        Guards that read the force.
    plain : bool
        Whether names have ASCII letters only, and texts no characters that XML forbids.
    """

    def said(text: str) -> str:
        return text.replace("σ", "sigma") if plain else text

    values = st.sampled_from([said(each) for each in VALUES])
    texts = TEXTS
    if plain:
        texts = st.text(st.characters(codec="ascii", min_codepoint=32), max_size=12)

    def some(keys: tuple[str, ...]) -> dict[str, str]:
        return draw(st.dictionaries(st.sampled_from(keys), values, max_size=len(keys)))

    known = [name for name in NAMES if name.isascii() or not plain]
    names = draw(st.lists(st.sampled_from(known), min_size=1, unique=True))
    states = []
    for name in names:
        locked = locks and draw(st.booleans())
        parts = [some(("z", "w")) for _ in range(3)]
        states.append(State(name, *parts, {} if locked else some(("F",)), locked))
    edges = [
        Transition(
            f"edge_{k}",
            draw(st.lists(st.sampled_from(names), min_size=1, unique=True)),
            draw(st.sampled_from(names)),
            said(draw(st.sampled_from([*GUARDS, *forces]))),
            some(("z", "v") if locks else ("z", "w")),
        )
        for k in range(draw(st.integers(0, 3)))
    ]
    parameters = [
        "k",
        Parameter(
            "F_c", "N", draw(st.sampled_from(["finite", "> 0", ">= k"])), meaning=draw(texts)
        ),
        Parameter(
            said("σ_0"), per_element=draw(st.booleans()), assumed=draw(st.sampled_from(["", "> 0"]))
        ),
    ]
    return Chart(
        draw(texts),
        inputs=draw(st.sampled_from([("v",), ("t", "v", "x"), ()])),
        variables=("z", "w"),
        parameters=draw(st.permutations(parameters)),
        states=states,
        transitions=edges,
        outputs={"F": draw(values)},
        reference=draw(texts),
        let=draw(st.sampled_from([{}, {"S": "k * v", "T": "S + 1"}])),
        contact_outputs=draw(st.sampled_from([{}, {"F": "F + v"}])),
        initial=draw(st.sampled_from([{}, {"z": -0.25}])),
    )


# --------------------------------------------------------------------------- what runs
def rounded(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers with three digits, evenly spread; they occasionally fall on boundaries."""
    return st.integers(0, 1000).map(lambda i: float(f"{low + (high - low) * i / 1000:.3g}"))


FLOWS = [
    "v", "0", "-z", "0.5 * (sgn(v) - z / s)", "0.2 * v * cos(z)", "tanh(v) - z",
    "v - abs(v) * z / s", "min(v, 0.2) - 0.5 * z", "max(-0.3, v) * exp(-abs(z))",
    "0.1 * sin(3 * t) - 0.2 * z",
]  # fmt: skip
CLAUSES = [
    "z >= {a}", "z <= -{a}", "abs(z) < {a}", "abs(z) >= s", "z >= s", "z <= -s", "abs(v) <= {b}",
    "v > {b}", "v < -{b}", "v >= {b}", "z * v > 0", "t > {a}", "sin(4 * t) > {b}", "z + v < {a}",
    "not (z < {a})",
]  # fmt: skip
EDGE_ACTIONS = [{}, {}, {}, {"z": "0.5 * z"}, {"z": "0"}, {"z": "z + 0.01"}]


@st.composite
def guards(draw: st.DrawFn) -> str:
    """One to three comparisons, joined."""
    parts = [
        text.format(a=draw(rounded(0.01, 0.3)), b=draw(rounded(0.0, 0.2)))
        for text in draw(st.lists(st.sampled_from(CLAUSES), min_size=1, max_size=3))
    ]
    return draw(st.sampled_from([" and ", " or "])).join(parts)


@st.composite
def switching_charts(draw: st.DrawFn) -> Chart:
    """Two or three states, and edges between them."""
    names = ["rest", "go", "turn"][: draw(st.integers(2, 3))]
    states = [
        State(name, {"z": draw(st.sampled_from(FLOWS))}, entry=draw(st.sampled_from(EDGE_ACTIONS)))
        for name in names
    ]
    pairs = [(a, b) for a in names for b in names if a != b]
    edges = [
        Transition(f"e{i}", *pair, draw(guards()), actions=draw(st.sampled_from(EDGE_ACTIONS)))
        for i, pair in enumerate(draw(st.lists(st.sampled_from(pairs), min_size=1, max_size=5)))
    ]
    return Chart(
        "random", ("v", "s", "t"), ("z",), ("k",), states, edges, {"F": "k * z + 0.1 * dz"}
    )


@st.composite
def chart_models(draw: st.DrawFn) -> ChartModel:
    """A bank of one to three elements of a random chart."""
    n = draw(st.integers(1, 3))
    F_c = draw(rounded(0.2, 0.8))
    return ChartModel(
        draw(switching_charts()),
        {"k": np.array(draw(st.lists(rounded(0.1, 9), min_size=n, max_size=n)))},
        n=n,
        stribeck=Stribeck(F_c, F_c * draw(rounded(1, 2)), draw(rounded(0.01, 0.3))),
        sigma_2=draw(rounded(0, 1)),
        weights=np.array(draw(st.lists(rounded(0.05, 0.5), min_size=n, max_size=n))),
    )


@st.composite
def banks(draw: st.DrawFn, law: str | None = None) -> GMS:
    """A GMS bank of one to four elements."""
    n = draw(st.integers(1, 4))

    def numbers(low: float, high: float) -> list[float]:
        return draw(st.lists(rounded(low, high), min_size=n, max_size=n))

    F_c = draw(rounded(0.1, 1))
    parameters = GMSParameters(
        numbers(0.5, 50),
        numbers(0, 1),
        numbers(0.01, 1),
        sigma_2=draw(rounded(0, 1)),
        stribeck=Stribeck(F_c, F_c * draw(rounded(1.01, 3)), draw(rounded(1e-3, 0.1))),
        v_c=draw(st.sampled_from([1e-6, 1e-4, 1e-3])),
        weights=numbers(0.03, 0.4),
    )
    law = law or draw(st.sampled_from(["signed", "published"]))
    return GMS(parameters, law=law)  # type: ignore[arg-type]


@st.composite
def ramps(draw: st.DrawFn, jumps: bool = False) -> list[tuple[float, float]]:
    """Corners of a velocity or a force; with `jumps`, some segments are vertical."""
    waits = draw(st.lists(rounded(0.05, 2), min_size=2, max_size=6))
    times = np.concatenate([[0.0], np.cumsum(waits)]).tolist()
    corners = [(t, draw(rounded(-0.6, 0.6))) for t in times]
    if jumps and draw(st.booleans()):
        place = draw(st.integers(1, len(corners) - 1))
        corners.insert(place, (corners[place][0], draw(rounded(-0.6, 0.6))))
    return corners


@st.composite
def signals(draw: st.DrawFn) -> Any:
    """A formula, ramps, a record or a constant."""
    kind = draw(st.sampled_from([0, 0, 0, 1, 1, 2, 3]))
    if kind == 0:
        a, w, p = draw(rounded(0.1, 0.6)), draw(rounded(0.5, 5)), draw(rounded(0, 6))
        text = draw(
            st.sampled_from(
                [
                    "{a}*sin({w}*t + {p})",
                    "{a}*sgn(sin({w}*t))*min(1, 9*abs(sin({w}*t)))",
                    "{a}*cos({w}*t)*exp(-t/{w})",
                    "{a}*tanh({w}*(t - 1))",
                    "{a}*(t - 1)**3",
                    "max(0, {a}*sin({w}*t + {p}))",
                ]
            )
        )
        return text.format(a=a, w=w, p=p)
    if kind == 1:
        return draw(ramps(jumps=True))
    if kind == 2:
        times = np.linspace(0.0, 6.0, draw(st.integers(9, 60)))
        a, w = draw(rounded(0.1, 0.6)), draw(rounded(0.5, 5))
        return times, (a * np.sin(w * times)).round(draw(st.integers(1, 6)))
    return draw(st.sampled_from([0.0, 0.2, -0.2, 1e-6, 1e-3]) | rounded(-0.6, 0.6))


@st.composite
def rigs(draw: st.DrawFn) -> Any:
    """Mostly open loop."""
    kind = draw(st.sampled_from([0, 0, 0, 1, 2]))
    mass = draw(rounded(0.2, 3))
    if kind == 1:
        return Slider(
            mass, draw(st.sampled_from(["3*sin(2*t)", "2*t - 3", "9*cos(t)"]) | signals())
        )
    if kind == 2:
        return PulledSlider(mass, draw(rounded(0.5, 9)), draw(rounded(-0.5, 0.5)))
    return Prescribed(draw(signals()))


@st.composite
def options(draw: st.DrawFn) -> dict[str, Any]:
    """Adaptive and fixed steps, located events and those at step ends."""
    kind = draw(st.integers(0, 5))
    if kind <= 2:
        found: dict[str, Any] = {
            "method": draw(st.sampled_from(["dp45", "bs23"])),
            "rtol": draw(st.sampled_from([1e-3, 1e-5, 1e-6, 1e-8])),
        }
        if draw(st.booleans()):
            found["max_step"] = draw(rounded(0.01, 1))
    else:
        methods = st.sampled_from(["rk4", "heun", "euler", "dp45"])
        found = {"method": draw(methods), "step": draw(rounded(0.003, 0.1))}
    if kind == 5:
        found["events"] = "step"
    return found


def moves(t_end: float) -> st.SearchStrategy[tuple[str, Any]]:
    """A move of a session of a bank, and what it takes."""
    return st.one_of(
        st.tuples(st.sampled_from(["step", "back"]), st.integers(1, 30)),
        st.tuples(st.sampled_from(["next", "prev"]), st.none()),
        st.tuples(st.just("goto"), st.floats(0.0, t_end)),
        st.tuples(
            st.sampled_from(["until", "last"]),
            st.sampled_from(["z1 > 0.1", "z1 < -0.05", "v > 0.2"]),
        ),
        st.tuples(st.just("switch"), st.integers(0, 5)),
        st.tuples(
            st.just("poke"), st.tuples(st.floats(-0.3, 0.3), st.sampled_from([None, "slip"]))
        ),
    )


# --------------------------------------------------------------------------- what is proved
LEFT = ["z", "abs(z)", "v", "abs(v)", "z * v", "z + v", "max(z, v)", "sgn(v) * z", "z ** 2"]
RIGHT = ["s", "-s", "v_c", "-v_c", "0", "1", "0.5 * s", "s + v_c", "-0.5"]
PROVABLE_FLOWS = st.sampled_from(["v", "0", "1 - z / s", "sgn(v) - z / s", "-v", "abs(v)", "z * v"])
COMPARISONS = st.builds(
    "{} {} {}".format,
    st.sampled_from(LEFT),
    st.sampled_from(["<", "<=", ">", ">="]),
    st.sampled_from(RIGHT),
)
PROVABLE_CLAUSES = st.one_of(
    COMPARISONS,
    COMPARISONS.map("not {}".format),
    st.builds("({} or {})".format, COMPARISONS, COMPARISONS),
)


@st.composite
def provable_charts(draw: st.DrawFn) -> Chart:
    """Two or three states, with edges of which some can hold at once, and cycles."""
    names = ["first", "second", "third"][: draw(st.integers(2, 3))]
    ends = st.sampled_from(names)
    guards = st.lists(PROVABLE_CLAUSES, min_size=1, max_size=3).map(" and ".join)
    actions = st.sampled_from([{}, {}, {}, {"z": "0"}, {"z": "-z"}, {"z": "s"}])
    edges = tuple(
        Transition(f"edge{i}", draw(ends), draw(ends), draw(guards), draw(actions))
        for i in range(draw(st.integers(2, 4)))
    )
    states = tuple(State(name, {"z": draw(PROVABLE_FLOWS)}) for name in names)
    return Chart("random", ("v", "s"), ("z",), ("v_c",), states, edges, {"F": "z"})


SURFACES = ["s", "-s", "0.5 * s", "v", "1", "1 / s", "0.5 + abs(v)", "max(v, s)", "min(v, s)"]
RESTS = ["v > v_c", "v <= v_c", "z > 0", "abs(v) <= v_c", "v < 0", "z * v >= 0"]


@st.composite
def pairs_on_a_surface(draw: st.DrawFn) -> Chart:
    """Two states whose guards share a surface, which is the name of the chart."""
    surface = draw(st.sampled_from(SURFACES))
    rests = st.lists(st.sampled_from(RESTS), max_size=2)
    go, back = (
        " and ".join([f"z {op} {surface}", *draw(rests)])
        for op in draw(st.sampled_from([(">=", "<"), ("<=", ">"), (">", "<="), (">", "<")]))
    )
    states = tuple(State(name, {"z": draw(PROVABLE_FLOWS)}) for name in ("first", "second"))
    edges = (Transition("go", "first", "second", go), Transition("back", "second", "first", back))
    return Chart(surface, ("v", "s"), ("z",), ("v_c",), states, edges, {"F": "z"})
