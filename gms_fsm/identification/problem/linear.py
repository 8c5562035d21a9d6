"""Which parameters the measured force is linear in: these are solved for, not searched.

They must not appear in any flow, guard, assignment or entry, so that the motion of the elements
does not depend on them; and no force may have the product of two of them. All of it is read from
the trees of the chart.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.parameters import SIGMA_2
from gms_fsm.language import Condition, Value, derivative, names_in, renamed
from gms_fsm.systems.mounted import Mounted
from gms_fsm.systems.numbers import known_in


def linear_names(subject: Mounted) -> tuple[str, ...]:
    """Return the names of the parameters that the friction force is linear in.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters
    >>> from gms_fsm.systems.mounted import mounted_alone
    >>> linear_names(mounted_alone(GMS(GMSParameters.paper("stick-slip"), law="signed")))
    ('k', 'sigma', 'sigma_2')
    """
    system = subject.system
    if system.flow or system.sampled or not all(body.driven for body in system.bodies):
        return ()
    names = {
        subject.of(contact.name, name)
        for contact in system.contacts
        for name in (
            *_linear_in(contact.chart),
            *([SIGMA_2.name] if contact.model is not None else ()),
        )
    }
    return tuple(name for name in known_in(subject) if name in names)


def _linear_in(chart: Chart) -> tuple[str, ...]:
    """Return the parameters of a chart that only its force reads, and that linearly."""
    moving = {name for tree in _of_motion(chart) for name in names_in(tree)}
    for name in reversed(list(chart.lets)):  # a let reads only those before it
        if name in moving:
            moving |= names_in(chart.lets[name])
    if moving & {*chart.force_names, *chart.rate_names}:
        return ()  # a guard or an action reads the force itself
    found = [name for name in chart.parameter_names if name not in moving]
    forces = [_expanded(chart, tree) for tree in chart.forces.values() if tree is not None]
    totals = [_expanded(chart, tree) for tree in chart.totals.values()]
    if totals and any(names_in(tree) & {*found} for tree in totals):
        # A total multiplies or shifts the sum of the forces; its own parameters are searched.
        found = [name for name in found if not any(name in names_in(tree) for tree in totals)]
    if not all(_is_affine(tree, chart.force_names) for tree in totals):
        return ()
    # What is not linear even alone keeps no other from being linear beside it.
    found = [name for name in found if all(_is_affine(tree, [name]) for tree in forces)]
    changed = True
    while changed:  # a parameter in a product with another is left out, then asked again
        changed = False
        for name in found:
            if not all(_is_affine(tree, [name], found) for tree in forces):
                found, changed = [each for each in found if each != name], True
                break
    return tuple(found)


def _is_affine(tree: Value, names: Iterable[str], others: Iterable[str] = ()) -> bool:
    """Return whether a value is affine in names, with slopes that read neither these nor others."""
    names = tuple(names)
    for name in names:
        slope = derivative(tree, name)
        if slope is None or names_in(slope) & {*names, *others}:
            return False
    return True


def _of_motion(chart: Chart) -> Iterator[Value | Condition]:
    """Return the trees that decide how the elements move."""
    yield from chart.flows.values()
    yield from chart.guards.values()
    for steps in chart.assignments.values():
        yield from steps.values()


def _expanded(chart: Chart, tree: Value) -> Value:
    """Return a tree with the chart's named expressions written out."""
    while names_in(tree) & {*chart.lets}:
        tree = renamed(tree, chart.lets)
    return tree
