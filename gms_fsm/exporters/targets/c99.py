"""C99 with located switches: the engine itself, for any controller or simulator."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.coupling.compensator import Compensator
from gms_fsm.errors import ParameterError
from gms_fsm.exporters._c import TAKES, WORDS, CEngine, engine_of, filled, safe
from gms_fsm.exporters._names import identifier
from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.plain.c import plain_c, plain_c_notes
from gms_fsm.formats import Format, register
from gms_fsm.foundation.text import visible
from gms_fsm.lowering.scales import scales_of
from gms_fsm.systems.signals import Corners
from integrators.machine_code.c99 import number_text

PERIOD, PERIODS, ROWS = 10.0, 2, 2000  # s; of the record that a single friction is given
FAR, FAST = 3.0, 100.0  # its amplitude, in deflections; or its speed, in those of the guards
SHOWN = 1000  # rows of 1 ms, of a system without records


def c99(subject: Subject) -> dict[str, str]:
    """Return header, source, a program that runs it on a record, that record, and a README."""
    made = engine_of(subject)
    name = made.name
    plain, notes = _plain(subject)
    calling = {} if subject.compensator is None else _compensator(subject.compensator, made)
    return {
        **plain,
        **calling,
        f"{name}.h": made.header,
        f"{name}.c": made.source,
        f"{name}_main.c": _main(made),
        f"{name}_record.csv": _record(subject),
        f"README-{name}-c99.md": f"{_readme(subject, made)}\n{notes}",
    }


def _plain(subject: Subject) -> tuple[dict[str, str], str]:
    """Return the files of the plain form, if there can be one, and what the README says of it."""
    if not subject.alone:
        return {}, ""
    for name in subject.chart.let:
        identifier(name, WORDS, f"let {name!r}")
    try:
        return plain_c(subject), f"## The plain form\n\n{plain_c_notes(subject)}"
    except ParameterError as error:
        return {}, f"There is no plain form: {error}\n"


def _compensator(given: Compensator, made: CEngine) -> dict[str, str]:
    """Return a header whose function a controller calls once a tick."""
    velocity, measured = "reference", given.feedback > 0.0
    if measured:
        velocity += f" + {number_text(given.feedback)} * (measured - reference)"
    more = [each for each in made.inputs if each != "v"]
    passed = "".join("c->v, v, " if each == "v" else f"{each}0, {each}1, " for each in made.inputs)
    force = "force"
    if math.isfinite(given.limit):
        most = number_text(given.limit)
        force = f"force > {most} ? {most} : force < -{most} ? -{most} : force"
    text = filled(
        "c/compensator.h",
        name=made.name,
        guard=made.name.upper(),
        title=safe(given.friction.model.chart.name),
        period=number_text(given.period),
        feedback=number_text(given.feedback),
        gain=number_text(given.gain),
        velocity=velocity,
        measured=", double measured" if measured else "",
        said="; measured: the measured velocity" if measured else "",
        arguments="".join(f", double {each}0, double {each}1" for each in more),
        passed=passed,
        force=force,
    )
    return {f"{made.name}_compensator.h": text}


def _main(made: CEngine) -> str:
    name, heads, rows = made.name, [], []
    for each in made.outputs:
        kind = "%lld" if each.place == "mode" else "%.17g"
        cast = "(long long)" if each.place == "mode" else ""
        for k in range(each.length or 1):
            heads.append(each.name if each.length is None else f"{each.name}[{k + 1}]")
            value = f"s->{each.name}" + ("" if each.length is None else f"[{k}]")
            rows.append(f'    printf(",{kind}", {cast}{value});')
    names = range(len(made.inputs))
    pairs = "".join(f"u{k}, w{k}, " for k in names)  # before, and now
    before = "".join(f"    double u{k} = 0.0, w{k} = 0.0;\n" for k in names)
    read = "".join(
        f"        u{k} = w{k};\n"
        f"        w{k} = number(&place, &read);\n"
        f"        if (row == 2)\n            u{k} = w{k};\n"
        for k in names
    )
    return filled(
        "c/main.c",
        name=name,
        columns=",".join(("t", *made.inputs)),
        heads=",".join(heads),
        rows="\n".join(rows),
        before=before,
        read=read,
        pairs=pairs,
        count=1 + len(made.inputs),
    )


def _record(subject: Subject) -> str:
    """Return a record for the inputs: that of the system, or a sine chosen by us."""
    t, columns = _sine(subject) if subject.alone else _records(subject)
    lines = [",".join(("t", *columns))]
    rows = zip(t.tolist(), *(each.tolist() for each in columns.values()), strict=True)
    return "\n".join([*lines, *(",".join(map(repr, row)) for row in rows), ""])


def _sine(subject: Subject) -> tuple[FloatArray, dict[str, FloatArray]]:
    scales = scales_of(subject.contact)
    sizes = [u for row in scales.variables.values() for u in row if u > 0.0]
    omega = 2.0 * math.pi / PERIOD
    speed = max(FAR * max(sizes, default=0.1) * omega, FAST * scales.speed)
    t = np.linspace(subject.t_start, subject.t_start + PERIOD * PERIODS, ROWS + 1)
    return t, {name: np.zeros(t.size) for name in subject.inputs} | {"v": speed * np.sin(omega * t)}


def _records(subject: Subject) -> tuple[FloatArray, dict[str, FloatArray]]:
    signals = subject.system.signals
    records = {name: each for name, each in signals.items() if isinstance(each, Corners)}
    t, after = _rows([*records.values()], subject.t_start)
    return t, {name: _values(each, t, after) for name, each in records.items()}


def _rows(records: list[Corners], t_start: float) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return the times of a record, twice where something jumps, and which are after a jump."""
    if not records:
        t: FloatArray = np.linspace(t_start, t_start + 1e-3 * SHOWN, SHOWN + 1)
        return t, np.ones(t.size, dtype=np.bool_)
    times = np.unique(np.concatenate([each.times for each in records]))
    times = np.unique([t_start, *times[times > t_start]])
    jumps = {float(u) for each in records for u in each.jumps if u > t_start}
    rows = [
        (u, side) for u in times.tolist() for side in ((False, True) if u in jumps else (True,))
    ]
    return np.array([u for u, _ in rows]), np.array([side for _, side in rows])


def _values(signal: Corners, t: FloatArray, after: NDArray[np.bool_]) -> FloatArray:
    """Return the values of a signal, on either side of its jumps."""
    times, values = signal.times, signal.values
    left, right = np.searchsorted(times, t, "left"), np.searchsorted(times, t, "right") - 1
    corner = (left <= right) & (right >= 0)
    at = np.where(after, right, np.minimum(left, times.size - 1))
    found: FloatArray = np.where(corner, values[at], np.interp(t, times, values))
    return found


def _readme(subject: Subject, made: CEngine) -> str:
    name = made.name
    inputs = ", ".join(f"`{each}`" for each in made.inputs) or "none"
    numbers = "\n".join(each.shown for each in made.parameters)
    settings = subject.settings
    return filled(
        "c/c99.md",
        name=name,
        title=visible(subject.title),
        arguments="".join(f"{each}0, {each}1, " for each in made.inputs),
        inputs=inputs,
        method=settings.method_name,
        rtol=repr(settings.rtol),
        numbers=numbers or "- none",
    )


register(
    Format(
        "c99",
        "friction",
        "C (C99) with located switches, and the plain form",
        "gms-fsm",
        c99,
        words=WORDS,
        takes=(*TAKES, "compensator"),
        whole=True,
    )
)
