"""What the notebook of lesson 4 adds: things to try."""

# %% [markdown]
# ## The two laws, as they are written
#
# The laws are texts of a chart; nothing else differs between the two runs above.

# %%
from gms_fsm.charts import SLIP_LAWS

for name, text in SLIP_LAWS.items():
    print(f"{name:<9}  dz = {text}")

# %% [markdown]
# ## Try
#
# - `gms_fsm.prove(result.published.model.chart)` needs no run to find the fault. What does it say,
#   and at which point?
# - Which share of the vanished heat belongs to each element?
# - Halve the period of the motion. Does z_1 go further down, or less far?
