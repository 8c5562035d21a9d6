"""All numbers of a system by name, as the generated functions take them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from gms_fsm.charts.parameters import is_list

if TYPE_CHECKING:
    from gms_fsm.systems.system import System


# What the trees call numbers that a model has besides the parameters of its chart.
CURVE, MODEL, WEIGHT = "curve ", "model ", "threshold weight"


def of(contact: str, name: str) -> str:
    """Return what a name of a contact is called in the trees."""
    return f"{contact}.{name}"


def numbers_of(system: System) -> tuple[dict[str, float], dict[str, tuple[int, np.ndarray]]]:
    """Return all numbers of a system by name."""
    shared = {of(owner, name) if owner else name: u for owner, name, u in shared_in(system)}
    machines = system.machines
    own = {of(machines[k].name, name): (k, values) for k, name, values in own_in(system)}
    return shared, own


def shared_in(system: System) -> Iterator[tuple[str, str, float]]:
    """Yield each number with one value, after its contact, if it has one, and its name there."""
    for contact in system.machines:  # what a model brings besides its chart's parameters
        if (model := contact.model) is not None:
            if (curve := model.stribeck) is not None:
                for name, value in curve.numbers.items():
                    yield contact.name, f"{CURVE}{name}", value
                yield contact.name, f"{CURVE}v dip", curve.dip
                yield contact.name, f"{CURVE}v flat", curve.flat
            yield contact.name, f"{MODEL}sigma_2", model.sigma_2
    for name, value in system.numbers.items():
        yield "", name, value
    for contact in system.machines:
        for name, given in contact.values.items():
            if not is_list(given):
                yield contact.name, name, float(given)


def own_in(system: System) -> Iterator[tuple[int, str, np.ndarray]]:
    """Yield numbers with one value per element, after the place of their contact and their name."""
    for index, contact in enumerate(system.machines):
        yield index, WEIGHT, np.asarray(contact.weights, dtype=np.float64)
        for name, given in contact.values.items():
            if is_list(given):
                yield index, name, np.asarray(given, dtype=np.float64)
