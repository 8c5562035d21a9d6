"""Additions of the notebook of lesson 8: the if-else text, and things to try."""

# %% [markdown]
# ## The if-else text
#
# This is the program that was compared: generated from the chart, as the if-else engine runs it.

# %%
from gms_fsm.lowering.program import lower

source = lower(result.ifelse.model, result.ifelse.rig).source
print(source[source.index("def switch") :].split("\n\n\n")[0])

# %% [markdown]
# ## Try
#
# - Run both drivers with `law="signed"`. Do they still diverge at the first reversal?
# - How late must a guard be checked to produce the residual in the paper? Which step does that?
# - Hold outputs for 0.7 ms (`events="held", step=7e-4`). Which transitions of `result.chart` are
#   missed, and why?
