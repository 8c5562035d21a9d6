"""All numbers of a system by name, as the generated functions take them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from gms_fsm.systems.system import System


# What the trees call numbers that a model has besides the parameters of its chart.
CURVE, MODEL, WEIGHT = "curve ", "model ", "threshold weight"


def of(contact: str, name: str) -> str:
    """Return what a name of a contact is called in the trees."""
    return f"{contact}.{name}"


def numbers_of(system: System) -> tuple[dict[str, float], dict[str, tuple[int, np.ndarray]]]:
    """Return all numbers of a system by name."""
    shared: dict[str, float] = {}
    own: dict[str, tuple[int, np.ndarray]] = {}
    for contact in system.machines:  # what a model brings besides its chart's parameters
        if (model := contact.model) is not None:
            if (curve := model.stribeck) is not None:
                for name, value in curve.numbers.items():
                    shared[of(contact.name, f"{CURVE}{name}")] = value
                shared[of(contact.name, f"{CURVE}v dip")] = curve.dip
                shared[of(contact.name, f"{CURVE}v flat")] = curve.flat
            shared[of(contact.name, f"{MODEL}sigma_2")] = model.sigma_2
    shared |= system.numbers
    for index, contact in enumerate(system.machines):
        weights = contact.weights
        own[of(contact.name, WEIGHT)] = index, np.asarray(weights, dtype=np.float64)
        for name, given in contact.values.items():
            if np.ndim(given) == 0:
                shared[of(contact.name, name)] = float(given)
            else:
                own[of(contact.name, name)] = index, np.asarray(given, dtype=np.float64)
    return shared, own
