"""Additions of the notebook of lesson 4: things to try."""

# %% [markdown]
# ## The text of the two laws
#
# The laws are texts in a chart; nothing else differs between the two runs above.

# %%
from gms_fsm.charts import SLIP_LAWS

for name, text in SLIP_LAWS.items():
    print(f"{name:<9}  dz = {text}")

# %% [markdown]
# ## Try
#
# - `gms_fsm.prove(result.published.model.chart)` finds the error without a run. What does it say,
#   and at which point?
# - What is each element's share of the missing heat?
# - Halve the period of the motion. Does z_1 decrease further, or less far?
