"""What the notebook of lesson 3 adds: the step, as a slider."""

# %% [markdown]
# ## Turn a knob
#
# Choose a step. Which of the 48 switches a program finds that looks at its guards once a step, is a
# matter of luck: a smaller step is not always a better one.

# %%
from ipywidgets import FloatSlider, interact
from matplotlib.figure import Figure

from gms_fsm.app.lessons.l3_missed_window import REVERSALS, ROWS, once_a_step, samples_in_window


def with_step(ms):
    trace = once_a_step(1e-3 * ms)
    figure = Figure(figsize=(6.4, 3.4), layout="constrained")
    ax = figure.subplots()
    ax.plot(ROWS, result.located.F, color="0.6", linewidth=3, label="located")
    ax.plot(ROWS, trace.F, linestyle="--", label="once a step")
    ax.set(xlabel="t [s]", ylabel="F [N]")
    ax.set_title(
        f"{ms:g} ms: {len(trace.transitions)} of 48 switches, "
        f"{samples_in_window(1e-3 * ms)} of {REVERSALS.size} reversals met"
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
# - How small must a fixed step be until every reversal is met whatever its phase? Compare it with
#   `window_width()`.
# - Run the same model with `method="dp45"`, `events="step"` and `max_step=1e-3`. Is an adaptive
#   step any better at it?
