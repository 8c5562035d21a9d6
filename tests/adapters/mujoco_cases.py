"""Joints with friction in MuJoCo; needs the extra mujoco."""

from __future__ import annotations

import mujoco

from gms_fsm import GMS, GMSParameters, Stribeck

SLIDE = """
<mujoco>
  <option timestep="0.001" gravity="0 0 0" integrator="{integrator}"/>
  <worldbody><body>
    <joint name="rail" type="slide" axis="1 0 0" stiffness="2"/>
    <geom size=".05" mass="1" contype="0" conaffinity="0"/>
  </body></worldbody>
</mujoco>
"""
ARM = """
<mujoco>
  <option timestep="0.001" gravity="0 0 0"/>
  <worldbody><body>
    <joint name="shoulder" axis="0 0 1" frictionloss="1.5"/>
    <geom size=".05" pos=".3 0 0" mass="1" contype="0" conaffinity="0"/>
    <body pos=".3 0 0">
      <joint name="elbow" axis="0 0 1" frictionloss="0.7"/>
      <geom size=".05" pos=".3 0 0" mass="1" contype="0" conaffinity="0"/>
    </body>
  </body>
  <body><joint name="ball" type="ball"/><geom size=".05" mass="1"/></body></worldbody>
</mujoco>
"""


def bearing() -> GMS:
    """Return the friction of a hinge, whose elements break away one after another."""
    parameters = GMSParameters.from_shares(
        [0.25] * 4,
        [1000.0, 400.0, 160.0, 64.0],  # Nm/rad
        C=20.0,  # Nm/s
        stribeck=Stribeck(F_c=1.0, F_s=1.5, v_s=0.05),  # Nm, Nm, rad/s
        v_c=1e-6,  # rad/s
        sigma=[0.4, 0.3, 0.2, 0.1],  # Nms/rad
    )
    return GMS(parameters, law="signed")


def loaded(text: str) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return a model and its data."""
    model = mujoco.MjModel.from_xml_string(text)
    return model, mujoco.MjData(model)
