"""Additions of the notebook of lesson 6: a slider for the pulling speed."""

# %% [markdown]
# ## Vary a parameter
#
# The same mass on the same spring, pulled from rest at a different speed.

# %%
from ipywidgets import FloatSlider, interact
from matplotlib.figure import Figure

from gms_fsm import PulledSlider, simulate
from gms_fsm.app.lessons.l6_stick_slip import MASS, STIFFNESS, bank


def pulled(V):
    trace = simulate(bank(), PulledSlider(MASS, STIFFNESS, V), 60.0)
    arrests = (trace.transitions.edge == "arrest").sum()
    figure = Figure(figsize=(6.4, 3.4), layout="constrained")
    ax = figure.subplots()
    ax.plot(trace.t, trace.v)
    ax.axhline(V, color="0.6", linestyle="--", linewidth=1)
    ax.set(xlabel="t [s]", ylabel="v [m/s]", title=f"V = {V:g} m/s (dashed): {arrests} arrests")
    return figure


V = FloatSlider(0.05, min=0.02, max=0.3, step=0.01, description="V [m/s]", continuous_update=False)
_ = interact(pulled, V=V)

# %% [markdown]
# ## Try
#
# - At which speed does stick-slip end? Does a stiffer spring raise or lower that speed?
# - Remove the Stribeck curve: `bank(F_s=1.0)`.
# - With v_s = 1e-3 m/s it never comes to rest again. Why? Look at v just before break-away.
