"""Additions of the notebook of lesson 7: a slider for the frequency."""

# %% [markdown]
# ## Vary a parameter
#
# The loop opens as the frequency rises to about w = C/s, and closes again beyond that.

# %%
import math

from ipywidgets import FloatLogSlider, interact
from matplotlib.figure import Figure

from gms_fsm import Prescribed, simulate
from gms_fsm.app.lessons.l7_frictional_lag import (
    ATOL,
    MEAN,
    MODEL,
    RTOL,
    SETTLED,
    SIGMA_2,
    STRIBECK,
    SWING,
    last_period,
)


def loop(w):
    period = 2 * math.pi / w
    end = period * (math.ceil(SETTLED / period) + 1)
    rig = Prescribed(f"{MEAN} + {SWING}*cos({w}*t)")
    cycle = last_period(simulate(MODEL, rig, end, rtol=RTOL, atol=ATOL), w)
    figure = Figure(figsize=(6.4, 3.8), layout="constrained")
    ax = figure.subplots()
    ax.plot(1e3 * cycle.v, STRIBECK(cycle.v) + SIGMA_2 * cycle.v, color="0.75", linewidth=5)
    ax.plot(1e3 * cycle.v, cycle.F)
    ax.set(xlabel="v [mm/s]", ylabel="F [N]", title=f"w = {w:.3g} rad/s (grey: steady sliding)")
    return figure


w = FloatLogSlider(45, min=0, max=2.7, step=0.05, description="w [rad/s]", continuous_update=False)
_ = interact(loop, w=w)

# %% [markdown]
# ## Try
#
# - Double C. At which frequency is the loop widest now?
# - In which direction is the loop traversed? Does it depend on the frequency?
