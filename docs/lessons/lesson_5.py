"""Additions of the notebook of lesson 5: a slider for the number of elements."""

# %% [markdown]
# ## Vary a parameter
#
# A bank of n elements approximates the parabola by n line segments.

# %%
from ipywidgets import IntSlider, interact
from matplotlib.figure import Figure

from gms_fsm import Prescribed, simulate
from gms_fsm.app.lessons.l5_how_many import ATOL, RTOL, SPEED, STROKE, bank, parabola


def chain(n):
    trace = simulate(bank(n), Prescribed(SPEED), STROKE / SPEED, rtol=RTOL, atol=ATOL)
    fine = trace.refined(2000)
    error = abs(fine.F - parabola(fine.x)).max()
    figure = Figure(figsize=(6.4, 3.8), layout="constrained")
    ax = figure.subplots()
    ax.plot(1e6 * fine.x, parabola(fine.x), color="0.75", linewidth=6, label="smooth curve")
    ax.plot(1e6 * fine.x, fine.F, label=f"n = {n}")
    ax.set(xlabel="x [um]", ylabel="F [N]", title=f"error at most {100 * error:.2f} % of F_c")
    ax.legend()
    return figure


_ = interact(chain, n=IntSlider(3, min=1, max=20, description="n", continuous_update=False))

# %% [markdown]
# ## Try
#
# - How many elements reduce the error below 0.1 % of F_c? Use the formula first, then the slider.
# - Space the thresholds geometrically instead of evenly. What happens to the small loop?
