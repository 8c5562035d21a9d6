"""Random charts with any of the parts that a chart can have."""

from __future__ import annotations

from hypothesis import strategies as st

from gms_fsm import Chart, Parameter, State, Transition

__all__ = ["charts"]

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
    )
