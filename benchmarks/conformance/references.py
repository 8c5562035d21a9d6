"""Compute what is expected with 50 digits, compare it with the closed forms, write the JSON files.

    python -m benchmarks.conformance.references [--check]

Between two switches the flow of a `Mechanism` is affine, so that its Taylor series is exact to the
digits that are kept; guards are bisected. Needs mpmath.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import mpmath as mp
import numpy as np

from benchmarks.conformance.automata import Mechanism
from benchmarks.conformance.cases import CASES, HERE, Case

DIGITS = 60  # kept; 50 are right
TERMS = 70
SAMPLES = 24  # of each guard in each step; closed forms check that nothing is missed
mp.mp.dps = DIGITS
SAME = mp.mpf(10) ** -40
ZERO = mp.mpf(10) ** -46  # rounding errors are near 1e-58
MP = SimpleNamespace(mpf=mp.mpf, pi=+mp.pi, small=SAME, zero=ZERO)


def run(mechanism: Mechanism, t_end: Any) -> None:
    """Run a mechanism to its end."""
    m, place = mechanism, mechanism.place["t"]
    m.settle()
    while m.y[place] < t_end:
        ahead = [knot for knot in m.knots if knot > m.y[place]]
        stop = min([t_end, *ahead])
        _arc(m, stop)
        if m.y[place] == stop and stop in ahead:
            m.enter(stop)
            m.settle()


def _arc(m: Mechanism, stop: Any) -> None:
    """Go on to the next switch, or to a time."""
    place, clock = m.place, m.place["t"]
    rates = [[(place[name], k) for name, k in rate.items()] for rate in m.dynamics(m.modes)[0]]
    guards = [
        [([(place[name], k) for name, k in f.items()], strict) for f, strict in conditions]
        for _, _, conditions in m.edges(m.modes)
    ]
    longest = _pace(rates)
    while (t := m.y[clock]) < stop:
        h = min(longest, stop - t)
        series = [list(m.y)]
        while len(series) < TERMS and any(series[-1]):
            k = len(series)
            series.append([_dot(rate, series[-1]) / k for rate in rates])
        series.reverse()
        tau, crossed = h, False
        for conditions in guards:
            lines = [([_dot(f, c) for c in series], strict) for f, strict in conditions]
            if (found := _first(lines, tau)) is not None:
                tau, crossed = found, True
        m.y = [mp.polyval([c[j] for c in series], tau) for j in range(len(m.y))]
        if crossed:
            m.settle()
            return
        if tau == stop - t:
            m.y[clock] = stop


def _dot(function: Sequence[tuple[int, Any]], y: Sequence[Any]) -> Any:
    return sum((k * y[j] for j, k in function), mp.mpf(0))


def _pace(rates: Sequence[Sequence[tuple[int, Any]]]) -> Any:
    """Return a step in which the series converges at once; where it ends, one of a second."""
    matrix = np.zeros((len(rates), len(rates)))
    for row, rate in zip(matrix, rates, strict=True):
        for j, k in rate:
            row[j] = float(k)
    if not np.linalg.matrix_power(matrix, len(rates)).any():
        return mp.mpf(1)
    fastest = np.abs(np.linalg.eigvals(matrix)).max()
    return mp.mpf(1.0 / max(fastest, 0.5))


def _first(falling: Sequence[tuple[list[Any], bool]], h: Any) -> Any | None:
    """Return when all polynomials are first positive (or not negative), to all digits."""

    def holds(tau: Any) -> bool:
        for line, strict in falling:
            value = mp.polyval(line, tau)
            if value < 0 or (strict and value <= ZERO):
                return False
        return True

    before = mp.mpf(0)
    for j in range(1, SAMPLES + 1):
        after = h * j / SAMPLES
        if holds(after):
            while after - before > mp.mpf(10) ** (8 - DIGITS) * h:
                middle = (before + after) / 2
                before, after = (before, middle) if holds(middle) else (middle, after)
            return after
        before = after
    return None


def expected(name: str, case: Case) -> dict[str, Any]:
    """Return the contents of the JSON file of a case."""
    exact = dict(case.closed(mp)) if case.closed is not None else {}
    told = " and ".join(
        [f"closed form: {case.formula}"] * bool(case.formula)
        + [f"benchmarks/conformance/references.py, {name}"]
        * (not case.refused and bool(case.build))
    )
    found: dict[str, Any] = {"title": case.title, "source": case.source, "reference": told}
    found |= {"t_end": case.t_end, "initial": dict(case.initial)}
    if case.refused:
        return found | {"refused": case.refused}
    end = {k: v for k, v in exact.items() if k[0] != "t" or not k[1:].isdigit()}
    switches: list[dict[str, Any]] | None = [] if case.logged else None
    if case.build is not None and case.logged:
        mechanism = case.build(MP)
        run(mechanism, mp.mpf(str(case.t_end)))
        log, state = mechanism.log, mechanism.end()
        times = {f"t{i}": fired.t for i, fired in enumerate(log)}
        for key, value in exact.items():
            got = times[key] if key in times else state[key]
            if abs(got - value) > SAME * 1e5:
                raise ValueError(f"{name}: {key} is {got}, in closed form {value}")
        end = {k: v for k, v in state.items() if not k.startswith("_")}
        if case.plain is None:
            switches = [
                {
                    "t": float(fired.t),
                    "contact": fired.contact,
                    "element": fired.element,
                    "edge": fired.edge,
                }
                for fired in log
            ]
    found["switches"] = switches
    found["end"] = {k: float(v) if abs(v) > SAME else 0.0 for k, v in end.items()}
    if case.mass:
        found["mass"] = dict(case.mass)
    return found | {"tolerance": dict(case.tolerance)}


def written(case: dict[str, Any]) -> str:
    """Return the text of a JSON file, one switch per line."""
    lines = []
    for key, value in case.items():
        text = json.dumps(value)
        if key == "switches" and value:
            text = "[\n" + ",\n".join(f"    {json.dumps(each)}" for each in value) + "\n  ]"
        lines.append(f"  {json.dumps(key)}: {text}")
    return "{\n" + ",\n".join(lines) + "\n}\n"


def main() -> None:
    """Write the files, or with --check compare them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing, say what differs")
    parser.add_argument("--only", help="one case")
    given = parser.parse_args()
    for name, case in CASES.items():
        if given.only in (None, name):
            path, text = HERE / f"{name}.json", written(expected(name, case))
            if not given.check:
                path.write_text(text, encoding="utf-8")
            same = path.read_text(encoding="utf-8") == text
            print(f"{name}: {'as in the file' if same else 'differs from the file'}")


if __name__ == "__main__":
    main()
