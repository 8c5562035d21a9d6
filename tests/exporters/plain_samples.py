"""Random samples of the plain form inside its limits, with the located engine beside it, in C."""

from __future__ import annotations

import subprocess
from dataclasses import dataclass
from pathlib import Path

from gms_fsm import GMS, GMSParameters, LuGre, Model, Stribeck, export
from gms_fsm.charts.registry import registered
from gms_fsm.systems.models import demonstration
from tests.exporters.c_programs import FLAGS

DRIVER = r"""
#include "it.h"
#include "it_plain.h"
#include <math.h>
#include <stdio.h>

static double uniform(uint64_t *seed)
{
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(*seed >> 11) / 9007199254740992.0;
}

int main(void)
{
    static it_state s;
    static it_plain p;
    uint64_t seed = 7;
    double v0 = 0.0, goal = 0.0, calm = 0.0, most = 0.0, largest = 0.0;
    long arrests = 0, found = 0, late = 0;
    it_init(&s);
    it_plain_start(&p);
    for (long k = 0; k < CALLS; k++) {
        const double dt = LONGEST * (0.1 + 0.9 * uniform(&seed));
        if (uniform(&seed) < 0.02)
            goal = FASTEST * (2.0 * uniform(&seed) - 1.0) * (uniform(&seed) < 0.5 ? 0.1 : 1.0);
        const double more = CHANGE * uniform(&seed);
        const double v1 = fabs(goal - v0) > CHANGE ? v0 + copysign(more, goal - v0) : goal;
        if (it_advance(&s, v0, v1, dt, it_MAX_STEPS) != it_OK)
            return 1;
        const double error = fabs(it_plain_sample(&p, v0, v1, dt) - s.F);
        bool same = true;
        for (int i = 0; i < COUNT; i++)
            same = same && s.state[i] == STATE(i);
        late += !same;
        calm = same ? fmax(calm, error) : calm;
        most = fmax(most, error);
        largest = fmax(largest, fabs(s.F));
        for (int64_t j = 0; j < s.logged; j++) {
            double t;
            int64_t i, edge;
            it_switch(&s, j, &t, &i, &edge);
            if (ARREST(edge)) {
                arrests++;
                found += STATE(i) == 0;
            }
        }
        v0 = v1;
    }
    printf("%ld %ld %ld %.17g %.17g %.17g\n", arrests, found, late, calm, most, largest);
    return 0;
}
"""


@dataclass(frozen=True)
class Limits:
    """What a friction is tried within: samples up to `longest` s, speeds up to `fastest` m/s."""

    longest: float
    fastest: float
    count: int
    state: str  # of element i of the plain form
    arrest: str  # whether an edge is one


CASES = {
    "GMS 4": Limits(0.05, 0.1, 4, "(int64_t)p.state[i]", "edge == it_edge_arrest"),
    "LuGre": Limits(1e-3, 0.1, 1, "0 * (i)", "edge < -1"),
    "elasto-plastic": Limits(
        1e-4, 5e-3, 1, "(int64_t)p.state",
        "edge == it_edge_turn_from_mixed || edge == it_edge_turn_from_plastic",
    ),
}  # fmt: skip


def friction(name: str) -> Model:
    """Return one of these frictions; v_s is 1 mm/s in all of them."""
    if name == "GMS 4":
        return GMS(GMSParameters.paper("stick-slip"), law="signed")
    if name == "LuGre":
        curve = Stribeck(F_c=1.0, F_s=1.5, v_s=1e-3)
        return LuGre(sigma_0=1e3, sigma_1=30.0, sigma_2=0.4, stribeck=curve)
    return demonstration(registered()[name])


@dataclass(frozen=True)
class Counts:
    """What came out; errors are shares of the largest force."""

    arrests: int
    found: int
    late: int  # samples at whose end a state differs
    error: float  # in the others
    largest: float  # in all


def sampled(name: str, calls: int, folder: Path, compiler: str) -> Counts:
    """Run random samples."""
    limits = CASES[name]
    export(friction(name), "c99", folder, name="it")
    (folder / "driver.c").write_text(DRIVER, encoding="utf-8")
    given = {
        "CALLS": str(calls), "LONGEST": repr(limits.longest), "FASTEST": repr(limits.fastest),
        "CHANGE": "1e-3", "COUNT": str(limits.count), "STATE(i)": limits.state,
        "ARREST(edge)": f"({limits.arrest})",
    }  # fmt: skip
    made = [f"-D{key}={value}" for key, value in given.items()]
    sources = ["it.c", "it_plain.c", "driver.c"]
    command = [compiler, *FLAGS, *made, *sources, "-o", "driver", "-lm"]
    subprocess.run(command, cwd=folder, check=True)
    done = subprocess.run([folder / "driver"], capture_output=True, text=True, check=True)
    arrests, found, late, error, most, largest = map(float, done.stdout.split())
    return Counts(int(arrests), int(found), int(late), error / largest, most / largest)
