"""The Prandtl-Tomlinson model: a tip that slides over a sinusoidal potential.

The contact is the surface. It acts on the tip with the force ``F_0 sin(2 pi x / a_0)``, the slope
of a potential of the corrugation ``F_0 a_0 / pi`` (from valley to hill), and with a viscous
damping. x is the position of the tip over the surface. The spring that pulls the tip belongs to the
system around the contact, as the inertia of the tip does: a pulled slider is the textbook's
picture.

Nothing switches. Where the potential is steeper than the pulling spring, ``2 pi F_0 / a_0 > K``,
the tip has several positions of rest. Pulled slowly it stays in one until that vanishes, and then
jumps to the next: atomic stick-slip, a sawtooth whose tops are below F_0. A softer potential gives
smooth sliding without static friction (superlubricity).

It shows stick-slip, static friction, hysteresis, and how friction vanishes when the spring is
stiff. It cannot show thermal activation (the temperature is zero), a Stribeck effect, or memory:
the tip forgets where it came from at each jump. In slow sliding the mean force does not depend on
the damping, which says only how fast a jump is over.

References
----------
L. Prandtl, "Ein Gedankenmodell zur kinetischen Theorie der festen Körper" (1928).
G. A. Tomlinson, "A Molecular Theory of Friction" (1929).
M. L. Iglesias, S. Gonçalves, "Sliding and Dry Friction: Prandtl-Tomlinson Athermal Model
Revisited", arXiv 1708.03414.
"""

from __future__ import annotations

from gms_fsm.charts.chart import Chart, State
from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.registry import Demonstration, Entry

PRANDTL_TOMLINSON = Chart(
    name="Prandtl-Tomlinson model",
    inputs=("x", "v"),
    parameters=(
        Parameter("F_0", "N", "> 0", meaning="largest force of the potential"),
        Parameter("a_0", "m", "> 0", meaning="period of the potential"),
        Parameter("c", "Ns/m", ">= 0", meaning="damping"),
    ),
    states=(State("surface", outputs={"F": "F_0 * sin(2 * pi * x / a_0) + c * v"}),),
    reference="Prandtl (1928), Tomlinson (1929)",
)
CHARTS = (
    Entry(
        "prandtl-tomlinson",
        PRANDTL_TOMLINSON,
        # Many jumps of the pulled slider of the examples: K = 2 N/m, and 2 pi F_0 / a_0 = 31 N/m.
        Demonstration({"F_0": 1.0, "a_0": 0.2, "c": 4.0}, "chosen by us"),
    ),
)
