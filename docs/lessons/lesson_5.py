"""What the notebook of lesson 5 adds: the number of elements, as a slider."""

# %% [markdown]
# ## Turn a knob
#
# A chain of n straight pieces along the parabola, as the bank of n elements makes it.

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
    ax.set(xlabel="x [um]", ylabel="F [N]", title=f"off by {100 * error:.2f} % of F_c at most")
    ax.legend()
    return figure


_ = interact(chain, n=IntSlider(3, min=1, max=20, description="n", continuous_update=False))

# %% [markdown]
# ## Try
#
# - How many elements until the error is below 0.1 % of F_c? Ask the formula first, then the slider.
# - Space the thresholds geometrically instead of evenly. What happens to the small loop?
