"""Additions of the notebook of lesson 9: a slider for the gap, and things to try."""

# %% [markdown]
# ## A system as code
#
# Two bodies, two contacts. Nothing in the bodies says that they touch.

# %%
import inspect

from gms_fsm.app.lessons import l9_contacts

source = inspect.getsource(l9_contacts.gear)
print("return System(" + source.partition("return System(")[2])

# %% [markdown]
# ## Vary a parameter
#
# The same gear with a different gap. While the motor crosses it, the load stands still.

# %%
from ipywidgets import FloatSlider, interact
from matplotlib.figure import Figure

from gms_fsm import simulate
from gms_fsm.app.lessons.l9_contacts import PERIOD, dead_time, gear


def with_gap(gap):
    trace = simulate(gear(gap), 2 * PERIOD)
    log = trace.contact("gear").transitions
    touches, leaves = log.t[log.source == "apart"][1:], log.t[log.target == "apart"]
    figure = Figure(figsize=(6.4, 3.4), layout="constrained")
    ax = figure.subplots()
    ax.plot(trace.t, trace.body("motor").x, "--", color="0.3", label="motor")
    ax.plot(trace.t, trace.body("load").x, label="load")
    ax.set(xlabel="t [s]", ylabel="angle [rad]")
    measured = f"{(touches - leaves).mean():.4f}"
    ax.set_title(f"dead time {measured} s; formula {dead_time(gap):.4f} s")
    ax.legend()
    return figure


gap = FloatSlider(
    0.02,
    min=0.005,
    max=0.05,
    step=0.005,
    readout_format=".3f",
    description="gap [rad]",
    continuous_update=False,
)
_ = interact(with_gap, gap=gap)

# %% [markdown]
# ## Try
#
# - Set the restitution to 0 and to 0.9 (`impact(e=...)`). How much energy is lost? Derive it from
#   the reduced mass, and compare.
# - Give the clutch a ratio: `v="w_1 - 3 * w_2"`. Which combination of the two angular momenta is
#   kept now?
# - Replace stiction by the bank in the bearing of the gear. Does the load still stand exactly
#   still?
# - Damp the flanks twenty times as much (`FLANK`, d = 8). Why does the formula for the dead time
#   fail? Look at the speed of the load when the flank lets go.
