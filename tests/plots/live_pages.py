"""Live pages, and the same runs by Python, for tests."""

from __future__ import annotations

import base64
import random
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from gms_fsm import Trace, simulate
from gms_fsm.app.scenario import Loaded, load_scenario
from gms_fsm.errors import GMSError
from gms_fsm.run.problem import Problem
from gms_fsm.run.settings import Settings
from gms_fsm.systems.mounted import Mounted, mounted
from gms_fsm.systems.numbers import numbers_of, with_numbers
from gms_fsm.traces.failures import SimulationError
from plots.page.live import play
from tests.helpers import FASTEST

# What the engine of a page finds with some numbers, as base64 of floats.
FOUND = """(sets, engines = (globalThis.engines ??= [])) => sets.map((numbers) => {
    for (const dial of dials.values()) setValue(dial, dial.given.value);
    for (const [name, u] of Object.entries(numbers)) setValue(dials.get(name), u);
    const found = (engines[live.number] ??= new Engine(ENGINES[live.number])).run(wordsNow());
    const text = (values) => {
        const bytes = new Uint8Array(values.slice().buffer), letters = [];
        for (let k = 0; k < bytes.length; k += 8192)
            letters.push(String.fromCharCode(...bytes.subarray(k, k + 8192)));
        return btoa(letters.join(""));
    };
    const names = ["t", "y", "seen", "mode", "log_t", "log_machine", "log_edge"];
    return names.map((name) => text(found[name]));
})"""


@dataclass(frozen=True, eq=False)
class LiveScenario:
    """A scenario of the package as a live page, and by Python."""

    loaded: Loaded
    what: Mounted
    arguments: dict[str, Any]

    @property
    def t_end(self) -> float:
        """s."""
        return float(self.loaded.subject[-1])

    def page(self, path: Path, **options: Any) -> Path:
        """Write the page."""
        return play(*self.loaded.subject, **self.arguments, **options).save(path)

    def run(self, numbers: dict[str, float]) -> Trace:
        """Run it with other numbers; what there is of a run that cannot go on."""
        what = with_numbers(self.what, numbers)
        given = {**self.arguments, "engine": FASTEST}
        try:
            return simulate(*_subject(what), self.t_end, **given)
        except SimulationError as error:
            return error.trace

    def start(self, numbers: dict[str, float]) -> Problem:
        """Return the beginning of a run."""
        more = {k: self.arguments[k] for k in ("t_start", "initial") if k in self.arguments}
        chosen = Settings(**{k: u for k, u in self.arguments.items() if k not in more})
        return Problem.on(with_numbers(self.what, numbers), self.t_end, chosen, **more)

    def sets(self, count: int, names: list[str], seed: int = 1) -> list[dict[str, float]]:
        """Return random numbers that the rules allow, some at a time."""
        drawn, found, numbers = random.Random(seed), list[dict[str, float]](), numbers_of(self.what)
        while len(found) < count:
            chosen = drawn.sample(names, min(len(names), drawn.randint(1, 4)))
            given = {name: _near(numbers[name].value, drawn) for name in chosen}
            try:  # rules, and whether it can begin
                self.start(given)
            except GMSError:
                continue
            found.append(given)
        return found


def _subject(what: Mounted) -> tuple[Any, ...]:
    return (what.system,) if what.named else (what.model, what.rig)


def _near(value: float, drawn: random.Random) -> float:
    return value * 2.0 ** drawn.uniform(-1.0, 1.0) if value else drawn.choice([0.0, 0.1])


@cache
def live_scenario(name: str) -> LiveScenario:
    """Return a scenario of the package, with a row at every step."""
    loaded = load_scenario(name)
    arguments = dict(loaded.arguments)
    for each in ("t_end", "t_eval", "engine", "monitors"):
        arguments.pop(each, None)
    *what, _ = loaded.subject
    held = Settings(**{k: u for k, u in arguments.items() if k not in ("t_start", "initial")})
    on = what[1] if len(what) > 1 else None
    return LiveScenario(loaded, mounted(what[0], on, held.held_period), arguments)


def differing(found: list[str], trace: Trace) -> tuple[int, int]:
    """Return how many floats of a page's run differ from those of a trace, of how many."""
    rows, log, layout = trace.rows, trace.firings, trace.program.layout
    seen = np.column_stack([
        trace.seen[name] if name in layout.observed.shared else trace.seen[name][:, i]
        for name, i in layout.observed
    ]) if layout.observed.size else np.empty((len(rows), 0))  # fmt: skip
    wanted = [rows.t, rows.y, seen, rows.mode, log.t, log.machine, log.edge]
    bad = count = 0
    for text, each in zip(found, wanted, strict=True):
        a = np.frombuffer(base64.b64decode(text), dtype="<f8")
        b = np.ravel(np.asarray(each, dtype=np.float64))
        count += b.size
        if a.size != b.size:
            bad += max(a.size, b.size)
            continue
        both = np.isnan(a) & np.isnan(b)
        bad += int(((a.view(np.int64) != b.view(np.int64)) & ~both).sum())
    return bad, count
