"""The Generalized Maxwell Slip element: a spring that sticks, breaks away and slips.

All of the model's switching is defined in this file, which does not know how the chart will be run.
It says when an element sticks, when it slips, and how its deflection evolves meanwhile; it
corresponds to Fig. 2b and 2c of the paper.

A bank of elements shows pre-sliding with nonlocal memory (inner loops close), the Stribeck effect,
frictional lag and stick-slip, and does not drift. The published law agrees with the signed law only
for v > 0: for v < 0 it makes energy. Neither shows an exact rest, because a sticking element is a
spring. One element alone has no smooth transition from sticking to slipping.

References
----------
K. Roffi, "State Transition Block Diagram of the Generalized Maxwell Slip Friction Model",
arXiv 2512.03049 (2025), eq. (1)-(4), Fig. 2. Its figures print no guard text; the guards here are
our reading of its Section II-D.
F. Al-Bender, V. Lampaert, J. Swevers, "The Generalized Maxwell-Slip Model: A Novel Model for
Friction Simulation and Compensation", IEEE Trans. Automatic Control 50(11), 1883-1887 (2005),
doi:10.1109/TAC.2005.858676, for the signed law.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, get_args

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.registry import Demonstration, Entry
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import either, refusing

__all__ = [
    "CHARTS",
    "GMS_ELEMENT",
    "LAWS",
    "PARAMETERS",
    "SLIP_LAWS",
    "TABLE_I",
    "WHICH_C",
    "WHICH_LAW",
    "Law",
    "check_law",
    "gms_element",
]

Law = Literal["signed", "published"]
LAWS: tuple[Law, ...] = get_args(Law)
WHICH_LAW = (
    "'signed' (Al-Bender et al. 2005) is for simulations; 'published', eq. (1) as printed, repeats "
    "the paper, and makes energy for v < 0"
)
GIVE_LAW = f"law={either(LAWS)}: {WHICH_LAW}"
WHICH_C = (
    "while an element slips, its force follows s(v) in the time F_c / C: for 50 ms at F_c = 1 N "
    "give C = 20 N/s with shares, or C_i = share * C / k_i in m/s, a list"
)

PARAMETERS = (
    Parameter("k", "N/m", "> 0", meaning="stiffness"),
    Parameter("sigma", "Ns/m", ">= 0", meaning="damping"),
    # With C = 0 the deflection does not move at all while slipping.
    Parameter("C", "m/s", ">= 0", assumed="> 0", meaning="attraction"),
    Parameter("v_c", "m/s", "> 0", per_element=False, meaning="arrest velocity"),
)
SLIP_LAWS = {
    "published": "sgn(v) * C * (1 - z / s)",  # (1) verbatim; unstable about z = +s for v < 0
    "signed": "C * (sgn(v) - z / s)",  # s carries the sign of v (Al-Bender et al.)
}


def check_law(law: object) -> None:
    """Refuse anything that is not a slip law.

    Parameters
    ----------
    law : str
        One of `LAWS`.

    Raises
    ------
    ParameterError
        If it is not one of them.
    """
    if law not in LAWS:
        raise ParameterError(f"it must be {either(LAWS)}", place="law", value=law, advice=WHICH_LAW)


@refusing(law=GIVE_LAW)
def gms_element(law: Law) -> Chart:
    """Return the chart of one GMS element under a slip law.

    Parameters
    ----------
    law : {"published", "signed"}
        ``"published"`` is eq. (1) of the paper as printed, ``"signed"`` the law of Al-Bender,
        Lampaert and Swevers (2005). They agree for v > 0. There is deliberately no default.

    Returns
    -------
    Chart
        States stick and slip; edges break_away_forward, break_away_backward, arrest.

    Raises
    ------
    ParameterError
        If the law is not one of the two.

    Examples
    --------
    >>> gms_element("signed").guard_text("arrest")
    '|v| <= v_c && |z| < s'
    """
    check_law(law)
    return Chart(
        name=f"GMS element, {law} law",
        inputs=("v", "s"),  # s = weight * Stribeck curve, supplied by the model
        variables=("z",),
        parameters=PARAMETERS,
        states=(
            State("stick", flow={"z": "v"}),
            State("slip", flow={"z": SLIP_LAWS[law]}),
        ),
        transitions=(
            Transition("break_away_forward", "stick", "slip", guard="z >= s and v > v_c"),
            Transition("break_away_backward", "stick", "slip", guard="z <= -s and v < -v_c"),
            Transition("arrest", "slip", "stick", guard="abs(v) <= v_c and abs(z) < s"),
        ),
        outputs={"F": "k * z + sigma * dz"},  # (3)
        reference="arXiv 2512.03049 (2025)",
    )


GMS_ELEMENT: Mapping[str, Chart] = {law: gms_element(law) for law in LAWS}

# The paper's numbers: one column for each of its two experiments, four elements, SI units.
TABLE_I = {
    "non-drifting": Demonstration(
        {"k": (100, 10, 1, 0.1), "sigma": (10, 0.1, 1, 1), "C": (1, 1, 1, 1), "v_c": 1e-6},
        "the paper's Table I, column non-drifting",
        stribeck=Stribeck(F_c=1, F_s=1.5, v_s=1e-3),
        sigma_2=4,
    ),
    "stick-slip": Demonstration(
        {
            "k": (0.7, 0.7, 0.7, 0.7),
            "sigma": (0.3, 0.4, 0.5, 0.6),
            "C": (0.1, 0.05, 0.025, 1e-4),
            "v_c": 1e-6,
        },
        "the paper's Table I, column stick-slip",
        stribeck=Stribeck(F_c=0.4, F_s=1.5, v_s=1e-3),
        sigma_2=0.1,
    ),
}
CHARTS = (
    Entry("gms", GMS_ELEMENT, TABLE_I["stick-slip"], title="Generalized Maxwell Slip element"),
)
