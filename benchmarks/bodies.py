"""Cost of a system for 3, 10 and 30 bodies: lines of text, time of one flow, time of a step.

Run with ``python -m benchmarks.bodies``. Every contact can lock. Processor time, best of several.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from gms_fsm import Body, Contact, System, simulate
from gms_fsm.charts import CHARTS
from gms_fsm.lowering.program import lower
from integrators.machine_code import calls

KINDS = ("on the ground", "chain", "tree")
NUMBERS = {"m": 1.0, "K": 2.0, "V": 0.1, "k": 30.0}
DRY = {"F_c": 1.0, "F_s": 1.5, "b": 0.1}


def bodies(kind: str, n: int) -> System:
    """Return n bodies, the first one pulled, with n contacts.

    Parameters
    ----------
    kind : str
        ``"on the ground"``: joined by springs, each with friction on the ground; ``"chain"``:
        friction between neighbours; ``"tree"``: between each body and its parent.
    n : int
        Number of bodies.

    Returns
    -------
    System
        To run.
    """
    forces, velocities = ["K * (V * t - x0)"] + ["0"] * (n - 1), []
    for i in range(n):
        if kind == "on the ground":
            near = [j for j in (i - 1, i + 1) if 0 <= j < n]
            forces[i] += "".join(f" + k * (x{j} - x{i})" for j in near)
            velocities.append(f"v{i}")
        elif i == 0:
            velocities.append("v0")
        else:
            velocities.append(f"v{i} - v{i - 1 if kind == 'chain' else (i - 1) // 2}")
    return System(
        f"{n} bodies, {kind}",
        bodies=[
            Body(f"b{i}", inertia="m", force=force, x=f"x{i}", v=f"v{i}")
            for i, force in enumerate(forces)
        ],
        contacts=[Contact(f"c{i}", CHARTS["stiction"], DRY, v=v) for i, v in enumerate(velocities)],
        numbers=NUMBERS,
    )


def best(call: Callable[[], object], repeats: int) -> float:
    """Return the shortest processor time of several calls, s."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        call()
        times.append(time.process_time() - start)
    return min(times)


def main() -> None:
    """Print a table."""
    calls.AT_ONCE = 0.0  # timed is the code that a second run ends with
    print("bodies               lines  flow in Python  per body  step compiled  per body")
    for kind in KINDS:
        for n in (3, 10, 30):
            system = bodies(kind, n)
            program = lower(system)
            layout = program.layout
            y, dy = [0.1] * layout.y.size, [0.0] * layout.y.size
            mode, held = list(layout.not_sliding([0] * layout.n)), [0.0] * program.held
            flow = program.functions["flow"]

            def many() -> None:
                for _ in range(200):
                    flow(0.1, y, mode, held, program.p, dy)  # noqa: B023

            once = best(many, 7) / 200
            rows = len(simulate(system, 20.0, engine="compiled").t)  # compiles it too
            short = best(lambda: simulate(system, 1e-3, engine="compiled"), 9)  # noqa: B023
            whole = best(lambda: simulate(system, 20.0, engine="compiled"), 9)  # noqa: B023
            step = max(whole - short, 0.0) / rows
            lines = len(program.source.splitlines())
            print(
                f"{n:>2} {kind:<16} {lines:>6} {1e6 * once:>12.1f} us {1e6 * once / n:>6.2f} us"
                f" {1e6 * step:>11.2f} us {1e6 * step / n:>6.2f} us"
            )


if __name__ == "__main__":
    main()
