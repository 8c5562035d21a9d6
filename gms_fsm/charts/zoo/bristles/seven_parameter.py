"""The seven-parameter model of Armstrong-Helouvry: a spring at rest, a Stribeck curve with memory.

At rest the contact is a spring of stiffness k_t. It breaks away at F_c plus a Stribeck force f,
which grows with the dwell time from its value at the end of the last slip, f_a, to F_s - F_c::

    stick   F = k_t z + F_v v
    slip    F = sgn(v) (F_c + f / (1 + (v_l / v_s)^2)) + F_v v
            f = f_a + (F_s - F_c - f_a) t / (t + gamma),  t: dwell time before this slip

The velocity v_l lags behind v; in motion f keeps its value at break-away. The seven parameters are
k_t, F_c, F_v, F_s, v_s, tau_L and gamma. Here F_s is the whole static friction after a long rest,
as in the other models; in the original it is the part above F_c.

Two differences from the original. (1) There v_l is v(t - tau_L), a pure delay; here it is a
first-order lag, tau_L dv_l/dt = v - v_l. The two agree to first order in tau_L. The cost: after a
sudden change of v the force begins to change at once and approaches its new value exponentially,
instead of changing tau_L later. For v = 1e-3 (1.5 + cos w t) m/s and the demonstration's numbers
the force differs from that with the delay by at most 4e-6, 4e-4 and 2.5e-3 N at w = 1, 10 and
25 rad/s, where the memory itself changes it by 1.1e-3, 1.1e-2 and 2.7e-2 N. (2) There the viscous
force acts in slip only; here in stick too, so that it does not jump at break-away.

What it shows: pre-sliding stiffness, the Stribeck curve, frictional lag, a break-away force that
rises with the dwell time and so falls with the rate of the load, stick-slip.

What it cannot show: hysteresis in pre-sliding (at rest it is a spring with almost no damping, on
which the mass rings) and memory of reversals. A reversal always ends a slip.

References
----------
B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, "A Survey of Models, Analysis Tools and
Compensation Methods for the Control of Machines with Friction", Automatica 30(7), 1083-1138
(1994), doi:10.1016/0005-1098(94)90209-7.
"""

from __future__ import annotations

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.registry import Demonstration, Entry

LAG = {"v_l": "(v - v_l) / tau_L"}
SEVEN_PARAMETER = Chart(
    name="Seven-parameter friction with a lag",
    inputs=("v",),
    variables=("z", "v_l", "f"),
    parameters=(
        Parameter("k_t", "N/m", "> 0", per_element=False, meaning="stiffness at rest"),
        Parameter("F_c", "N", "> 0", per_element=False, meaning="Coulomb friction"),
        Parameter("F_v", "Ns/m", ">= 0", per_element=False, meaning="viscous friction"),
        Parameter("F_s", "N", ">= F_c", per_element=False, meaning="stiction after a long rest"),
        Parameter("v_s", "m/s", "> 0", per_element=False, meaning="Stribeck velocity"),
        Parameter("tau_L", "s", "> 0", per_element=False, meaning="time of the frictional lag"),
        Parameter("gamma", "s", "> 0", per_element=False, meaning="dwell time for half the rise"),
    ),
    states=(
        State(
            "stick",
            flow={"z": "v", **LAG},
            entry={"f": "curve"},
            exit={"f": "risen"},
            outputs={"F": "k_t * z + F_v * v"},
        ),
        State("forward", flow=LAG, outputs={"F": "F_c + curve + F_v * v"}),
        State("backward", flow=LAG, outputs={"F": "-F_c - curve + F_v * v"}),
    ),
    transitions=(
        Transition(
            "break_away_forward", "stick", "forward", guard="k_t * z >= F_c + risen and v > 0"
        ),
        Transition(
            "break_away_backward", "stick", "backward", guard="k_t * z <= -F_c - risen and v < 0"
        ),
        Transition(
            "arrest_forward",
            "forward",
            "stick",
            guard="v < 0",
            actions={"z": "(F_c + curve) / k_t"},
        ),
        Transition(
            "arrest_backward",
            "backward",
            "stick",
            guard="v > 0",
            actions={"z": "-(F_c + curve) / k_t"},
        ),
    ),
    reference="Armstrong-Helouvry et al. (1994), lag in place of the delay",
    let={
        "curve": "f / (1 + (v_l / v_s)**2)",
        "risen": "f + (F_s - F_c - f) * age / (age + gamma)",
    },
    layout={"forward": (0, 0), "stick": (0, 170), "backward": (0, 340)},
)
CHARTS = (
    Entry(
        "seven-parameter",
        SEVEN_PARAMETER,
        Demonstration(
            {
                "k_t": 1e5,
                "F_c": 1.0,
                "F_v": 0.4,
                "F_s": 1.5,
                "v_s": 1e-3,
                "tau_L": 5e-3,
                "gamma": 1.0,
            },
            "chosen by us: k_t = sigma_0 and F_v = sigma_2 of the other models",
        ),
    ),
)
