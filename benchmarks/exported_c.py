"""What exported C costs: code, memory, and the time of a call with a sample of 1 ms.

Each case is exported with ``gms-fsm export --to c99`` and compiled by gcc: the engine, which
locates switches, and the plain form, which asks its guards once a step. Both run over the same
random motion, in interleaved rounds with `FrictionState` on the engine's machine code.

    python benchmarks/exported_c.py [--rounds 9]
    python benchmarks/exported_c.py --write        the table in docs/howto/exports.md
"""

from __future__ import annotations

import argparse
import itertools
import statistics
import subprocess
import tempfile
import textwrap
import time
from pathlib import Path

import numpy as np
from compare import WIDTH, machine, markdown, replace

from gms_fsm import GMS, FrictionState, GMSParameters, LuGre, Model, Stribeck, export
from gms_fsm.exporters import Subject
from gms_fsm.exporters._c import engine_of

PAGE = "docs/howto/exports.md"
CALLS, DT = 20_000, 1e-3  # of a round, s
FLAGS = ["-std=c99", "-ffp-contract=off"]
TIMER = """\
#include "{name}.h"
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
int main(void)
{{
    static double v[{calls} + 1];
    static {kind} s;
    double F = 0.0;
    for (int k = 0; k <= {calls}; k++)
        if (scanf("%lf", &v[k]) != 1)
            return 1;
    {name}_{begin}(&s);
    clock_t start = clock();
    for (int k = 0; k < {calls}; k++) {{
        {call}
    }}
    printf("%.17g %.17g\\n", (double)(clock() - start) / CLOCKS_PER_SEC / {calls}, F);
    return 0;
}}
"""
ENGINE = "if ({name}_advance(&s, v[k], v[k + 1], 1e-3, {name}_MAX_STEPS)) return 2; F += s.F;"
PLAIN = "F += {name}_step(&s, v[k], 1e-3);"


def cases() -> dict[str, Model]:
    """Return the frictions."""
    curve = Stribeck(F_c=1.0, F_s=1.5, v_s=1e-3)
    numbers = GMSParameters.paper("stick-slip")
    wide = GMSParameters(
        np.tile(numbers.k, 4),
        np.tile(numbers.sigma, 4),
        np.tile(numbers.C, 4),
        sigma_2=0.1,
        stribeck=numbers.stribeck,
        v_c=1e-6,
    )
    return {
        "GMS, 4 elements": GMS(numbers, law="signed"),
        "GMS, 16 elements": GMS(wide, law="signed"),
        "LuGre": LuGre(sigma_0=1e3, sigma_1=30.0, sigma_2=0.4, stribeck=curve),
    }


def motion() -> list[float]:
    """Return the velocities."""
    random = np.random.default_rng(1)
    t = np.arange(CALLS + 1) * DT
    knots = np.linspace(0.0, t[-1], 41)
    v: list[float] = np.interp(t, knots, random.normal(size=knots.size) * 0.3).tolist()
    return v


class Program:
    """A compiled form of a friction."""

    def __init__(self, folder: Path, name: str, call: str, kind: str, begin: str) -> None:
        call = call.format(name=name)
        timer = TIMER.format(name=name, calls=CALLS, call=call, kind=kind, begin=begin)
        (folder / f"{name}_timer.c").write_text(timer)
        self.path = folder / name
        sources = [f"{name}.c", f"{name}_timer.c"]
        subprocess.run(["gcc", *FLAGS, "-O2", *sources, "-o", name, "-lm"], cwd=folder, check=True)
        self.sizes = []
        for level in ("-O2", "-Os"):
            subprocess.run(
                ["gcc", *FLAGS, level, "-c", f"{name}.c", "-o", "one.o"], cwd=folder, check=True
            )
            text = subprocess.run(
                ["size", "one.o"], cwd=folder, check=True, capture_output=True, text=True
            ).stdout
            code, data, *_ = map(int, text.splitlines()[1].split()[:3])
            self.sizes.append(code + data)
        probe = f'#include "{name}.h"\n#include <stdio.h>\n'
        probe += f'int main(void) {{ printf("%zu", sizeof({kind})); return 0; }}\n'
        (folder / "probe.c").write_text(probe)
        subprocess.run(["gcc", "-std=c99", "probe.c", "-o", "probe"], cwd=folder, check=True)
        self.state = int(subprocess.run([folder / "probe"], check=True, capture_output=True).stdout)

    def timed(self, v: str) -> float:
        """Return the seconds of a call."""
        done = subprocess.run([self.path], input=v, text=True, capture_output=True, check=True)
        return float(done.stdout.split()[0])


def in_python(model: Model, v: list[float]) -> float:
    """Return the seconds of a call of `FrictionState.advance`."""
    friction = FrictionState(model, engine="compiled")
    start = time.process_time()
    for v0, v1 in itertools.pairwise(v):
        friction.advance(v0, v1, DT)
    return (time.process_time() - start) / CALLS


def row(name: str, model: Model, rounds: int) -> list[tuple[str, ...]]:
    """Return the rows of one friction: the engine, and the plain form."""
    v = motion()
    text = "\n".join(map(repr, v))
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        export(model, "c99", folder, name="it")
        lines = len(engine_of(Subject.of(model, "c99", name="it")).source.splitlines())
        engine = Program(folder, "it", ENGINE, "it_state", "init")
        plain = Program(folder, "it_plain", PLAIN, "it_plain", "start")
        found = []
        for _ in range(rounds):
            found.append((engine.timed(text), plain.timed(text), in_python(model, v)))
        plain_lines = len((folder / "it_plain.c").read_text().splitlines())
    located, once, python = (1e6 * statistics.median(each) for each in zip(*found, strict=True))
    return [
        (
            name, "located", f"{lines:,}", *(f"{u / 1024:.1f}" for u in engine.sizes),
            f"{engine.state:,}", f"{located:.2f}", f"{python:.2f}",
        ),
        (
            name, "plain", f"{plain_lines:,}", *(f"{u / 1024:.1f}" for u in plain.sizes),
            f"{plain.state:,}", f"{once:.3f}", "",
        ),
    ]  # fmt: skip


def page(rounds: int) -> str:
    """Return what the page says, measured here."""
    head = (
        "",
        "form",
        "lines",
        "code -O2, kB",
        "-Os, kB",
        "struct, B",
        "call, µs",
        "in Python, µs",
    )
    rows = [each for name, model in cases().items() for each in row(name, model, rounds)]
    gcc = subprocess.run(["gcc", "-dumpversion"], capture_output=True, text=True, check=True).stdout
    about = f"{machine('llvmlite')}, gcc {gcc.strip()}; medians of {rounds} interleaved rounds."
    return "\n".join([*markdown(head, rows), "", textwrap.fill(about, WIDTH)])


def main() -> None:
    """Print the table, or write it into the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--write", action="store_true", help=f"replace the table in {PAGE}")
    options = parser.parse_args()
    text = page(options.rounds)
    if options.write:
        replace(PAGE, text)
    else:
        print(text)


if __name__ == "__main__":
    main()
