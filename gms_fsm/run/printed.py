"""A run as a program that needs nothing but Python: its functions, and a demonstration of them."""

from __future__ import annotations

from pprint import pformat
from typing import Any

from gms_fsm.lowering.generated import standalone
from gms_fsm.run.problem import Problem
from gms_fsm.run.ticks import clocks_of

FIRST, MOST = 1000, 128_000  # steps of a demonstration


def printed(start: Problem) -> str:
    """Return a program that takes a run's steps and prints its switches.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> text = printed(Problem.of(model, Prescribed("0.1*t"), 1.0))
    >>> text.splitlines()[-2:]
    ['if __name__ == "__main__":', '    _main()']
    """
    data = pformat(_data(start), width=96, sort_dicts=False, compact=True)
    return f"{standalone(start.program.source)}\n\n{HEAD}_demonstration = {data}\n\n\n{LOOP}"


def _data(start: Problem) -> dict[str, Any]:
    program, layout = start.program, start.program.layout
    several = len(layout.banks) > 1
    return {
        "t": start.t_start,
        "t_end": start.last,
        "y": list(start.y),
        "mode": [int(each) for each in start.mode[layout.elements]],
        "p": program.p,
        "signs": program.live,
        "clocks": [(each.period, each.offset) for each in clocks_of(start.system)],
        "discrete": list(program.discrete),
        "machines": [
            f"{bank.name}, element {i + 1}" if several else f"element {i + 1}"
            for bank in layout.banks
            for i in range(bank.n)
        ],
        "edges": [(name, target) for name, _, target in layout.edges],
        "names": [
            f"{layout.label(name)}{i + 1 if bank_n > 1 else ''}"
            for name, bank_n, i in _components(start)
        ],
    }


def _components(start: Problem) -> list[tuple[str, int, int]]:
    """Return name, number of elements and element of every component of the state vector."""
    y = start.program.layout.y
    found: dict[int, tuple[str, int, int]] = {y.index(name): (name, 1, 0) for name in y.shared}
    for block in y.blocks:
        for name in block.names:
            for i in range(block.n):
                found[y.index(name, i)] = (name, block.n, i)
    return [each for _, each in sorted(found.items())]


HEAD = """\
# A demonstration: python THIS_FILE.py [end in s [number of steps]]. The guards are evaluated once a
# step, at most one edge is taken for each element, and the flow is integrated by Euler's method;
# gms-fsm itself locates the switches.
"""
LOOP = '''\
def _run(t_end, steps):
    """Return the switches, the last time, the last state, and how large its numbers became."""
    from fractions import Fraction

    given = _demonstration
    t0, p, discrete = given["t"], given["p"], given["discrete"]
    y, mode, signs = list(given["y"]), list(given["mode"]), given["signs"]
    edges, dy, switches, size = [0] * len(mode), [0.0] * len(y), [], [0.0] * len(y)
    ticked = [0] * len(given["clocks"])  # how often each clock has ticked

    def due(k):
        """Return the next tick of a clock, the nearest number to a sum of decimal numbers."""
        period, offset = (Fraction(repr(number)) for number in given["clocks"][k])
        return float(Fraction(repr(t0)) + offset + ticked[k] * period)

    t, step = t0, 0
    while True:
        bits = 0
        for k in range(len(ticked)):
            if due(k) <= t and t < t_end:
                bits |= 1 << k
                ticked[k] += 1
        if bits:
            tick(bits, t, y, mode, p)
        switch(t, y, mode, p, [0] * len(mode), edges)
        asked = 0
        for i, edge in enumerate(edges):
            asked |= discrete[i] & bits
            if edge >= 0 and (discrete[i] == 0 or discrete[i] & bits):
                act(edge, i, t, y, mode, p)
                switches.append((t, i, edge))
        if asked:
            tick(asked, t, y, mode, p)  # what they give out is held from now on
        if t >= t_end:
            return switches, t, y, size
        flow_live(t, y, mode, signs, p, dy)
        after = t0 + (step + 1) * (t_end - t0) / steps
        if after + 1e-12 * abs(t_end) >= t_end:
            after = t_end
        stop = after
        for k in range(len(ticked)):
            stop = min(stop, due(k))
        if stop >= after:
            stop = after
            step += 1
        for j in range(len(y)):
            y[j] += (stop - t) * dy[j]
            size[j] = max(size[j], abs(y[j]))
        t = stop


def _tried(t_end, steps):
    """Return a run, or None if it leaves the numbers."""
    try:
        found = _run(t_end, steps)
    except (ArithmeticError, ValueError):
        return None
    switches, t, y, size = found
    return found if all(u - u == 0.0 for u in y) else None


def _agree(coarse, fine):
    """Return whether two runs have the same switches, and ends alike to a hundredth."""
    if coarse is None or fine is None:
        return False
    if [each[1:] for each in coarse[0]] != [each[1:] for each in fine[0]]:
        return False
    return _apart(coarse, fine) <= 0.01


def _apart(coarse, fine):
    """Return the largest difference of the last states, each relative to its largest value."""
    (_, _, y, size), (_, _, y_2, size_2) = coarse, fine
    pairs = zip(y, y_2, map(max, size, size_2))
    return max([abs(u - w) / most for u, w, most in pairs if u != w], default=0.0)


def _difference(coarse, fine, steps):
    """Say how far a run is from one with fewer steps."""
    if coarse is None:
        return f"{steps} steps are too few to compare it with"
    ours, others = fine[0], coarse[0]
    same = 0
    while same < min(len(ours), len(others)) and ours[same][1:] == others[same][1:]:
        same += 1
    if same == len(ours) == len(others):
        end = f"its end differs by {100 * _apart(coarse, fine):.2g} % of the largest values"
        return f"a run of {steps} steps has the same switches, and {end}"
    return f"a run of {steps} steps has {len(others)}, of which the first {same} are the same"


def _main():
    """Print the switches of a run."""
    import sys

    given = _demonstration
    t_end = float(sys.argv[1]) if len(sys.argv) > 1 else given["t_end"]
    if len(sys.argv) > 2:
        steps, said = int(sys.argv[2]), ""
        found = _tried(t_end, steps)
    else:
        steps = FIRST_STEPS
        found, before = _tried(t_end, steps), None
        while not _agree(before, found) and steps < MOST_STEPS:
            steps, before = 2 * steps, found
            found = _tried(t_end, steps)
        said = "; twice the step gives the same"
        if found is not None and not _agree(before, found):
            said = "; " + _difference(before, found, steps // 2)
    if found is None:
        sys.exit(f"not finite: take more than {steps} steps to t = {t_end!r} s, or an earlier end")
    switches, t, y, size = found
    for at, i, edge in switches:
        name, target = given["edges"][edge]
        print(f"t = {at:.6g} s  {given['machines'][i]}: {name} -> {target}")
    print(f"{len(switches)} switches in {steps} steps to t = {t:.6g} s{said}")
    print(", ".join(f"{name} = {u:.6g}" for name, u in zip(given["names"], y)))


if __name__ == "__main__":
    _main()
'''.replace("FIRST_STEPS", str(FIRST)).replace("MOST_STEPS", str(MOST))
