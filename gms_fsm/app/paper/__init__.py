"""The paper's two experiments, run, drawn, and judged claim by claim.

Here are the numbers and signals of the experiments, which the help of the command line shows;
`gms_fsm.app.paper.experiments` runs them, `gms_fsm.app.paper.claims` judges them,
`gms_fsm.app.paper.writing` writes what came out. The paper prints neither the applied force of
Fig. 3 nor the velocity of Fig. 4 nor its guards; what is used here is chosen by us, said in the
output, and can be changed.

References
----------
K. Roffi, arXiv 2512.03049 (2025), Section III, Table I, Fig. 3 and 4.
"""

from __future__ import annotations

__all__ = ["FIG3_END", "FIG4_END", "FORCE", "PAPER_RTOL", "PAPER_STEP", "VELOCITY"]

FORCE = "min(0.25*t, max(0.25, 0.75 - 0.125*t)) + 0.1*sin(2*pi*2*(max(t, 4) - 4))"
VELOCITY = "0.15*sin(2*pi*t/25)"
FIG3_END, FIG4_END = 30.0, 100.0  # s
PAPER_STEP, PAPER_RTOL = 1e-3, 1e-4  # the paper's ode45 settings; atol is not printed
