"""Values to doubt: not finite, outside the domain of a chart, functions of time not seen enough."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from gms_fsm.charts.nesting import output_text
from gms_fsm.charts.parameters import FloatArray
from gms_fsm.charts.registry import domain_of
from gms_fsm.errors import GMSError
from gms_fsm.language import names_in, parse_condition, truths
from gms_fsm.session.trust._path import Track
from gms_fsm.systems.signals import Function
from gms_fsm.traces.scope import guard_columns
from gms_fsm.traces.trace import Trace
from gms_fsm.traces.verdicts import Doubt
from integrators import DP45, METHODS

PER_STEP, IN_ALL = 12, 20_000  # times at which a function is looked at
MISSED = 1e-5  # of span and duration: a larger integral of what no step has seen is worth a warning
NOTICED = 1e-2  # of the span


def not_finite(trace: Trace) -> Iterator[Doubt]:
    """Yield the outputs of one contact that are not finite somewhere."""
    names = (*trace.model.chart.force_names, "F_elements")
    for name in names:
        if trace.places.of(name) not in trace.seen:
            continue
        wrong = ~np.isfinite(trace.seen[trace.places.of(name)])
        rows = np.flatnonzero(wrong if wrong.ndim == 1 else wrong.any(axis=1))
        if not rows.size:
            continue
        t, element = float(trace.t[rows[0]]), None
        if wrong.ndim == 2:
            element = int(np.flatnonzero(wrong[rows[0]])[0])
        who = name if element is None else f"F of element {element + 1}"
        whose, text = trace.which, _force_text(trace, name, int(rows[0]), element)
        yield Doubt(
            "not finite",
            "warning",
            f"{f'{whose}.' * bool(whose)}{who} is not finite in {rows.size} of {len(trace)} rows, "
            f"first at t = {t:.9g} s: look at the parameters in [{text}]",
            (t,),
            whose,
            element,
        )
        return


def _force_text(trace: Trace, name: str, row: int, element: int | None) -> str:
    """Return the text of what is not finite, of an element or summed over them."""
    chart, name = trace.model.chart, "F" if name == "F_elements" else name
    if element is None and name in chart.contact_outputs:
        return chart.contact_outputs[name]
    state = chart.states[int(trace.modes[row, element or 0])]
    return output_text(chart.nesting, chart.outputs, state.name, name) or name


def outside(trace: Trace) -> Iterator[Doubt]:
    """Yield the conditions that proofs about the chart assume and the run of a contact breaks."""
    chart, shape = trace.model.chart, trace.modes.T.shape
    known = [*chart.inputs, *chart.velocities, *chart.variables, *chart.parameter_names]
    declared = [chart.declared[name] for name in chart.inputs if name in chart.declared]
    rules = [rule for each in declared for rule in each.conditions]
    for text in domain_of(chart) or rules:
        try:
            tree = parse_condition(text, [*dict.fromkeys(known)])
            columns = guard_columns(trace, names_in(tree))
        except (GMSError, KeyError):
            continue  # it names what only a proof has
        held = truths(tree, columns, shape)
        if held.all():
            continue
        element, row = (int(u) for u in np.argwhere(~held)[np.argwhere(~held)[:, 1].argmin()])
        values = ", ".join(
            f"{name} = {np.broadcast_to(columns[name], shape)[element, row]:.6g}"
            for name in sorted(names_in(tree))
        )
        t, whose = float(trace.t[row]), trace.which
        yield Doubt(
            "domain",
            "warning",
            f"{trace.subject.element(trace.places.name, element)} leaves the domain of its chart "
            f"at t = {t:.9g} s: {text} does not hold ({values}); what is proved about the chart "
            "does not hold there",
            (t,),
            whose,
            element,
        )


def sampling(path: Track, *, steps: bool) -> Iterator[Doubt]:
    """Yield the Python functions of time that have changed between the times the run saw."""
    for name, signal in path.trace.what.system.signals.items():
        if not isinstance(signal, Function):
            continue
        if not steps:
            yield Doubt(
                "not judged",
                "note",
                f"whether the function {name}(t) was seen often enough cannot be told from rows at "
                "requested times",
            )
            continue
        t = np.unique(path.rows.t)
        # A foreign method looks about as often.
        method = METHODS.get(str(path.trace.settings["method"]), DP45)
        stages = np.unique([0.0, *method.C, 1.0])
        if (missed := _missed(signal.call, t, stages)) is not None:
            at, value, seen = missed
            yield Doubt(
                "sampling",
                "warning",
                f"the function {name}(t) is {value:.6g} near t = {at:.6g} s, where the steps see "
                f"{seen:.6g}: they pass over it; give it as text or as a table of times and "
                "values, or a max_step shorter than what must be seen",
                (at,),
            )


def _missed(
    call: Callable[[float], float], t: FloatArray, stages: FloatArray
) -> tuple[float, float, float] | None:
    """Return where a function differs most from what the stages of steps have seen of it."""
    span = np.diff(t)
    if not span.size:
        return None
    try:
        seen = np.array([_called(call, a, h, stages) for a, h in zip(t, span, strict=False)])
        counts = np.maximum(PER_STEP, np.ceil(IN_ALL * span / span.sum())).astype(int)
        worst, found = MISSED, None
        for k, count in enumerate(counts.tolist()):
            theta = (np.arange(count) + 0.5) / count
            values, expected = _called(call, t[k], span[k], theta), _through(stages, seen[k], theta)
            rest = np.abs(values - expected)
            scale = max(seen.max(), values.max()) - min(seen.min(), values.min())
            if not scale > 0.0 or rest.max() < NOTICED * scale:
                continue
            part = float(rest.mean() * span[k] / (scale * span.sum()))
            if part > worst:
                j = int(rest.argmax())
                at = float(t[k] + theta[j] * span[k])
                worst, found = part, (at, float(values[j]), float(expected[j]))
        return found
    except Exception:  # the user's function may raise anything where the run has not asked it
        return None


def _called(
    call: Callable[[float], float], start: float, span: float, at: FloatArray
) -> FloatArray:
    return np.array([float(call(start + part * span)) for part in at.tolist()])


def _through(stages: FloatArray, values: FloatArray, theta: FloatArray) -> FloatArray:
    """Return the polynomial through what the stages of a step have seen."""
    if np.ptp(values) == 0.0:
        return np.full(theta.shape, values[0])
    fitted = np.polynomial.Polynomial.fit(stages, values, len(stages) - 1)
    return np.asarray(fitted(theta), dtype=np.float64)
