"""Additions of the notebook of lesson 10: choosing a model, a slider, and things to try."""

# %% [markdown]
# ## Choose a model
#
# The model with the fewest states that shows what is wanted, and shows nothing wrongly:

# %%
for wanted in (["drift"], ["drift", "lag"], ["break-away", "drift", "lag", "memory"]):
    print(f"{', '.join(wanted)}: {result.choice(wanted)}")

# %% [markdown]
# Every verdict can be opened: its experiment, its numbers, and the threshold with its reason.

# %%
found = result.table.cell("elasto-plastic", "memory")
print(found.verdict, "-", found.said)
for number in found.numbers:
    print(f"  {number.name}: {number}")
phenomenon = next(each for each in result.table.phenomena if each.name == "memory")
print(textwrap.fill(phenomenon.experiment, 84))
for limit in phenomenon.limits.values():
    text = f"threshold {limit.value:g}: {limit.meaning} ({limit.reason})"
    print(textwrap.fill(text, 84))

# %% [markdown]
# ## Vary a parameter
#
# A GMS bank with a different number of elements, in the memory experiment. One element is a spring
# below break-away: it has no loop at all.

# %%
import numpy as np
from ipywidgets import IntSlider, interact
from matplotlib.figure import Figure

from gms_fsm import GMS, GMSParameters, Stribeck, measure_phenomena


def bank(n):
    share = 0.5 ** np.arange(n)
    share /= share.sum()
    curve = Stribeck(F_c=1.0, F_s=1.5, v_s=1e-3)
    return GMSParameters.from_shares(
        np.full(n, 1 / n),
        1e5 * share,
        C=50.0,
        sigma=316.23 * share,
        stribeck=curve,
        v_c=1e-8,
        sigma_2=0.4,
    )


def nested(n):
    table = measure_phenomena({"bank": GMS(bank(n), law="signed")}, ["memory"])
    found = table.cell("bank", "memory")
    figure = Figure(figsize=(6.4, 3.6), layout="constrained")
    ax = figure.subplots()
    ax.plot(found.curves[0].x, found.curves[0].y)
    ax.set(xlabel="x [µm]", ylabel="applied force [N]")
    verdict = f"n = {n}, {found.verdict}: {found.said}; gap {found.numbers[0]}"
    ax.set_title(verdict, fontsize=9)
    return figure


n = IntSlider(4, min=1, max=8, description="elements n", continuous_update=False)
_ = interact(nested, n=n)

# %% [markdown]
# ## Try
#
# - Measure Dahl's model, Maxwell slip and Karnopp, too
#   (`measure_phenomena(["dahl", "maxwell-slip", "karnopp"], ...)`). Which of them would you take
#   for a contact that must rest and remember reversals, and need not lag?
# - Double sigma_1 of LuGre (`LuGre(...)` as a model of your own). Which numbers change, and does a
#   verdict change?
# - Which value of C of the bank halves the lag? Does the break-away force still fall with the rate?
# - Read the reason of a threshold, and choose your own. At which threshold would LuGre rest?
# - Step through the replay page. Which elements of the bank slip while the inner loop is run
#   through, and in which order do they arrest?
