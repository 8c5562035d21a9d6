"""Coulomb friction in the plane: one contact with two velocities, and stiction.

In motion the friction force has the size F_c and points against the velocity (v, w). At rest it is
whatever holds the contact, up to the stiction F_s in any direction. The contact sticks exactly.

What it shows: that friction in one direction vanishes while the contact slides fast in another
one, which is how dither and sideways motion release a contact; the shape of the path of a body
that is pushed around.

What it cannot show: pre-sliding, a Stribeck curve, spin about the normal. The direction of the
velocity is undefined at rest, so the speed v_c decides what counts as motion. After release the
force keeps the direction of the load until the speed exceeds v_c, and the contact sticks when the
speed falls below v_c / 2. The velocity lost at this moment, up to v_c / 2, is the error of the
model; v_c should be small compared with any speed of interest.

References
----------
S. Goyal, A. Ruina, J. Papadopoulos, "Planar sliding with dry friction. Part 1. Limit surface and
moment function", Wear 143(2), 307-330 (1991), doi:10.1016/0043-1648(91)90104-3. The two speeds are
our way to leave and to reach rest.
"""

from __future__ import annotations

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.registry import Demonstration, Entry

PLANAR_COULOMB = Chart(
    name="Coulomb friction in the plane",
    inputs=(),
    velocities=("v", "w"),
    variables=("h", "g"),  # direction of the load at release
    parameters=(
        Parameter("F_c", "N", "> 0", per_element=False, meaning="Coulomb friction"),
        Parameter("F_s", "N", ">= F_c", per_element=False, meaning="stiction"),
        Parameter("v_c", "m/s", "> 0", per_element=False, meaning="speed that counts as motion"),
    ),
    states=(
        State(
            "stuck",
            locked=True,
            exit={"h": "F / sqrt(F**2 + F_w**2)", "g": "F_w / sqrt(F**2 + F_w**2)"},
        ),
        State("start", outputs={"F": "F_c * h", "F_w": "F_c * g"}),
        State(
            "slip",
            outputs={
                "F": "F_c * v / sqrt(v**2 + w**2)",
                "F_w": "F_c * w / sqrt(v**2 + w**2)",
            },
        ),
    ),
    transitions=(
        Transition("release", "stuck", "start", guard="F**2 + F_w**2 > F_s**2"),
        Transition("moves", "start", "slip", guard="v**2 + w**2 > v_c**2"),
        Transition("arrest", "slip", "stuck", guard="v**2 + w**2 < 0.25 * v_c**2", impulse=True),
    ),
    reference="Goyal et al. (1991)",
)
CHARTS = (
    Entry(
        "planar-coulomb",
        PLANAR_COULOMB,
        Demonstration({"F_c": 1.0, "F_s": 1.5, "v_c": 1e-4}, "chosen by us"),
    ),
)
