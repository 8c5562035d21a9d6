"""What the notebook of lesson 8 adds: both texts side by side, and things to try."""

# %% [markdown]
# ## The if-else text
#
# This is what was compared: the program made from the chart, as the if-else engine runs it.

# %%
from gms_fsm.lowering.program import lower

source = lower(result.ifelse.model, result.ifelse.rig).source
print(source[source.index("def switch") :].split("\n\n\n")[0])

# %% [markdown]
# ## Try
#
# - Run both drivers with `law="signed"`. Do they still part at the first reversal?
# - How late must a guard be asked to leave the residual the paper prints? Which step does that?
