"""Additions of the notebook of lesson 3: a slider for the step."""

# %% [markdown]
# ## Vary a parameter
#
# Choose a step. How many of the 48 switches are found by a program that checks its guards once per
# step is a matter of luck: a smaller step is not always better.

# %%
from ipywidgets import FloatSlider, interact
from matplotlib.figure import Figure

from gms_fsm.app.lessons.l3_missed_window import REVERSALS, ROWS, once_a_step, samples_in_window


def with_step(ms):
    trace = once_a_step(1e-3 * ms)
    figure = Figure(figsize=(6.4, 3.4), layout="constrained")
    ax = figure.subplots()
    ax.plot(ROWS, result.located.F, color="0.6", linewidth=3, label="located")
    ax.plot(ROWS, trace.F, linestyle="--", label="once per step")
    ax.set(xlabel="t [s]", ylabel="F [N]")
    ax.set_title(
        f"{ms:g} ms: {len(trace.transitions)} of 48 switches, "
        f"{samples_in_window(1e-3 * ms)} of {REVERSALS.size} reversals hit"
    )
    ax.legend()
    return figure


ms = FloatSlider(
    1.003,
    min=0.5,
    max=2,
    step=0.001,
    readout_format=".3f",
    description="step [ms]",
    continuous_update=False,
)
_ = interact(with_step, ms=ms)

# %% [markdown]
# ## Try
#
# - How small must a fixed step be to hit every reversal, whatever its phase? Compare it with
#   `window_width()`.
# - Run the same model with `method="dp45"`, `events="step"` and `max_step=1e-3`. Is an adaptive
#   step any better?
