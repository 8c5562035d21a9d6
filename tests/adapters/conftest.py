"""Which modules of this folder pytest does not search for doctests."""

collect_ignore = ["mujoco_cases.py"]  # needs MuJoCo, which its tests look for before they import it
