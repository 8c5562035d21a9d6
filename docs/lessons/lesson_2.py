"""Additions of the notebook of lesson 2: a slider for the amplitude of the oscillating force."""

# %% [markdown]
# ## Vary a parameter
#
# The force above oscillates with an amplitude of 0.1 N. LuGre's drift grows with the amplitude; the
# GMS bank that has slipped once only oscillates with a larger stroke.

# %%
from ipywidgets import FloatSlider, interact
from matplotlib.figure import Figure

from gms_fsm import GMS, Slider, simulate
from gms_fsm.app.lessons.l2_drift import END, TABLE_I, cycle_means
from gms_fsm.app.paper.experiments import lugre_like


def shaken(amplitude):
    force = f"min(0.25*t, max(0.25, 0.75 - 0.125*t)) + {amplitude}*sin(2*pi*2*(max(t, 4) - 4))"
    gms = GMS(TABLE_I.with_weights(0.25 / TABLE_I.k), law="signed")
    figure = Figure(figsize=(6.4, 3.8), layout="constrained")
    ax = figure.subplots()
    for name, model in (("LuGre", lugre_like(TABLE_I)), ("GMS, weights 0.25/k", gms)):
        trace = simulate(model, Slider(1.0, force), END)
        t, x = cycle_means(trace)
        drift = 1e3 * (x[-1] - x[0]) / (t[-1] - t[0])
        ax.plot(trace.t, 1e3 * trace.x, label=f"{name}: {drift:.2f} mm/s")
    ax.set(xlabel="t [s]", ylabel="x [mm]", title=f"force amplitude {amplitude:g} N")
    ax.legend()
    return figure


amplitude = FloatSlider(
    0.1, min=0, max=0.2, step=0.02, description="amplitude", continuous_update=False
)
_ = interact(shaken, amplitude=amplitude)

# %% [markdown]
# ## Try
#
# - At which weights w_i = c/k_i does the first element begin to slip?
# - Does LuGre drift backward if the load is removed before the oscillation starts?
