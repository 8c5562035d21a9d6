"""Additions of the notebook of lesson 1: a slider for the reversal point."""

# %% [markdown]
# ## Vary a parameter
#
# The motion goes to +20 um, back to b, and on to +30 um. Wherever b is, the force passes again
# through the point (circle) at which the inner loop began.

# %%
from ipywidgets import FloatSlider, interact
from matplotlib.figure import Figure

from gms_fsm import GMS, Prescribed, simulate
from gms_fsm.app.lessons.l1_hysteresis import FINE, PARAMETERS, strokes


def inner_loop(b):
    velocity, times = strokes([20e-6, 1e-6 * b, 30e-6])
    trace = simulate(GMS(PARAMETERS, law="signed"), Prescribed(velocity), times[-1], atol=FINE)
    turn = trace.sample(times[:1])
    figure = Figure(figsize=(6.4, 3.8), layout="constrained")
    ax = figure.subplots()
    ax.plot(1e6 * trace.x, trace.F)
    ax.plot(1e6 * turn.x, turn.F, "o", markersize=9, markerfacecolor="none")
    ax.set(xlabel="x [um]", ylabel="F [N]", title=f"reversals at 20 um and at {b:g} um")
    return figure


b = FloatSlider(0, min=-20, max=18, step=1, description="b [um]", continuous_update=False)
_ = interact(inner_loop, b=b)

# %% [markdown]
# ## Try
#
# - How far back must b be before an element slips backward? Derive it from `PARAMETERS.weights`.
# - Add an element to the bank (`GMSParameters.from_shares`). Where does the loop change?
# - Run the same strokes with `LuGre` and look at the circle.
