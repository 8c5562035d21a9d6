"""Reproduction of the paper's two experiments: runs, figures and an assessment of each claim.

This module has the numbers and signals of the experiments, which the help of the command line
shows. `gms_fsm.app.paper.experiments` runs them, `gms_fsm.app.paper.claims` assesses the claims,
and `gms_fsm.app.paper.writing` writes the results. The paper prints neither the applied force of
Fig. 3 nor the velocity of Fig. 4 nor the guards. Those used here were chosen by us; the output
says so, and they can be changed.

References
----------
K. Roffi, arXiv 2512.03049 (2025), Section III, Table I, Fig. 3 and 4.
"""

from __future__ import annotations

__all__ = [
    "FIG3_END",
    "FIG4_END",
    "FIG4_HELD_END",
    "FORCE",
    "HELD_STEPS",
    "PAPER_RTOL",
    "PAPER_STEP",
    "VELOCITY",
]

FORCE = "min(0.25*t, max(0.25, 0.75 - 0.125*t)) + 0.1*sin(2*pi*2*(max(t, 4) - 4))"
VELOCITY = "0.15*sin(2*pi*t/25)"
FIG3_END, FIG4_END = 30.0, 100.0  # s
FIG4_HELD_END = 30.0  # s: a little more than one period, for charts with held outputs
PAPER_STEP, PAPER_RTOL = 1e-3, 1e-4  # the paper's ode45 settings; atol is not printed
HELD_STEPS = (2e-3, PAPER_STEP, 5e-4)  # s: sample times of charts with held outputs
