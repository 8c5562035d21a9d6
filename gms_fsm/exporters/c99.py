"""C99 with located switches: the engine itself, for any controller or simulator."""

from __future__ import annotations

import math

import numpy as np

from gms_fsm.exporters._c import WORDS, Engine, engine_of
from gms_fsm.exporters._registry import Exporter, register
from gms_fsm.exporters._subject import Subject
from gms_fsm.lowering.scales import scales_of
from gms_fsm.systems.signals import Corners
from gms_fsm.systems.system import System

__all__ = ["c99"]

PERIOD, PERIODS, ROWS = 10.0, 2, 2000  # s; of the record that a single friction is given
FAR, FAST = 3.0, 100.0  # its amplitude, in deflections; or its speed, in those of the guards
SHOWN = 1000  # rows of 1 ms, of a system without records


def c99(subject: Subject) -> dict[str, str]:
    """Return header, source, a program that runs it on a record, that record, and a README.

    Parameters
    ----------
    subject : Subject
        A friction or a system.

    Returns
    -------
    dict of str to str
        Contents by file name.
    """
    made = engine_of(subject)
    name = made.name
    return {
        f"{name}.h": made.header,
        f"{name}.c": made.source,
        f"{name}_main.c": _main(made),
        f"{name}_record.csv": _record(subject),
        "README-c99.md": _readme(subject, made),
    }


def _main(made: Engine) -> str:
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
        f"        w{k} = strtod(end + (*end == ','), &end);\n"
        f"        if (row == 2)\n            u{k} = w{k};\n"
        for k in names
    )
    return f"""\
/* Runs {name}.c on a record. It reads rows {",".join(("t", *made.inputs))} from the standard input,
 * whose first line names the columns, and writes the outputs. With a file name as argument it also
 * writes each switch to that file: time, element (from 1), edge. Written by gms-fsm. */
#include "{name}.h"

#include <stdio.h>
#include <stdlib.h>

enum {{ LONGEST = 4096 }};

static void write_row(const {name}_state *s)
{{
    printf("%.17g", s->t);
{chr(10).join(rows)}
    printf("\\n");
}}

static void write_switches(const {name}_state *s, FILE *file)
{{
    double t;
    int64_t element, edge;
    for (int64_t k = 0; k < s->logged; k++) {{
        {name}_switch(s, k, &t, &element, &edge);
        fprintf(file, "%.17g,%d,%s\\n", t, (int)element + 1, {name}_edge(edge));
    }}
}}

int main(int argc, char **argv)
{{
    static char line[LONGEST];
    FILE *switches = argc > 1 ? fopen(argv[1], "w") : NULL;
    {name}_state s;
    int code = {name}_OK;
    long row = 0;
{before}    if (argc > 1 && !switches) {{
        fprintf(stderr, "cannot write %s\\n", argv[1]);
        return 1;
    }}
    {name}_init(&s);
    printf("t,{",".join(heads)}\\n");
    while (code == {name}_OK && fgets(line, LONGEST, stdin)) {{
        char *end = line;
        double t;
        if (row++ == 0)
            continue;
        t = strtod(line, &end);
{read}        code = {name}_advance_to(&s, {pairs}t);
        if (code == {name}_OK)
            write_row(&s);
        if (switches)
            write_switches(&s, switches);
    }}
    if (switches)
        fclose(switches);
    if (code == {name}_OK)
        return 0;
    fprintf(stderr, "row %ld: %s\\n", row, {name}_message(code));
    return 1;
}}
"""


def _record(subject: Subject) -> str:
    """Return a record for the inputs: that of the system, or a sine chosen by us."""
    given = subject.given
    if isinstance(given, System):
        signals = {name: given.signals[name] for name in subject.inputs}
        records = {name: each for name, each in signals.items() if isinstance(each, Corners)}
        if not records:
            t = subject.t_start + 1e-3 * np.arange(SHOWN + 1)
        else:
            t = np.unique(np.concatenate([each.times for each in records.values()]))
            t = t[t >= subject.t_start]
        columns = {name: np.interp(t, each.times, each.values) for name, each in records.items()}
    else:
        scales = scales_of(subject.start.system.contacts[0])
        sizes = [u for row in scales.variables.values() for u in row if u > 0.0]
        omega = 2.0 * math.pi / PERIOD
        speed = max(FAR * max(sizes, default=0.1) * omega, FAST * scales.speed)
        t = subject.t_start + PERIOD * PERIODS / ROWS * np.arange(ROWS + 1)
        columns = {name: np.zeros(t.size) for name in subject.inputs}
        columns["v"] = speed * np.sin(omega * t)
    lines = [",".join(("t", *columns))]
    rows = zip(t.tolist(), *(each.tolist() for each in columns.values()), strict=True)
    return "\n".join([*lines, *(",".join(map(repr, row)) for row in rows), ""])


def _readme(subject: Subject, made: Engine) -> str:
    name = made.name
    inputs = ", ".join(f"`{each}`" for each in made.inputs) or "none"
    numbers = "\n".join(
        f"- `{each.name}` = {', '.join(map(repr, each.values))} {each.unit}".rstrip()
        for each in made.parameters
    )
    settings = subject.settings
    return f"""\
# {subject.title} in C99

`{name}.h` and `{name}.c` are the engine of gms-fsm, translated: adaptive steps, switches located
inside each call, the same results to the last bit. No heap, no globals; everything is in one struct
of type `{name}_state`.

    {name}_state s;
    {name}_init(&s);
    {name}_advance(&s, {"".join(f"{each}0, {each}1, " for each in made.inputs)}dt);

Inputs: {inputs}. During a call each input runs on a straight line. Outputs are fields of the
struct; the header says what they are. All numbers are in SI units.

Run it on the record beside it:

    cc -std=c99 -O2 -ffp-contract=off {name}.c {name}_main.c -o {name} -lm
    ./{name} {name}_switches.csv < {name}_record.csv > {name}_trace.csv

`-ffp-contract=off` keeps the bits; `-ffast-math` must not be used. Method {settings.method_name},
relative tolerance {settings.rtol!r}.

Numbers, which `{name}_set` changes (their rules are not checked there):

{numbers}
"""


register(Exporter("c99", "C99 with located switches, and the plain form", c99, WORDS))
