"""generate(): motions that take every edge and every pair of edges of a chart that can be taken."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.parameters import checked_scalar
from gms_fsm.errors import MissingExtraError, ParameterError
from gms_fsm.foundation.arguments import checked_integer, checked_path, refusing, unknown
from gms_fsm.foundation.files import output_folder
from gms_fsm.foundation.quantities import wrapped
from gms_fsm.generation.search import Goal, MotionSearch, Taken, Tried, firings_of, goals_of
from gms_fsm.generation.search import shown as shown_by
from gms_fsm.generation.stand import CONTACT, MASS, SETTINGS, Drive, Stand
from gms_fsm.run.problem import Problem
from gms_fsm.run.simulate import simulate
from gms_fsm.session.tree.export import save_scenario
from gms_fsm.systems.any_model import any_contact, with_chart
from gms_fsm.systems.given import mapping_of
from gms_fsm.systems.models import Model
from gms_fsm.systems.mounted import contact_of
from gms_fsm.systems.parts import Contact
from gms_fsm.systems.system import System
from gms_fsm.traces.coverage.counting import of_view
from gms_fsm.traces.coverage.counts import Score
from gms_fsm.traces.coverage.reasons import lines
from gms_fsm.traces.coverage.total import Coverage
from gms_fsm.traces.trace import Trace
from gms_fsm.verification.reaching.points import GuardPoints, TurningPoint
from gms_fsm.verification.reaching.unreachable import Nowhere, numbers_fit

__all__ = ["Generated", "GeneratedRun", "Unreached", "generate"]

HOLD = 0.1  # share of a motion by which it is made longer, if its end shows too little


@dataclass(frozen=True, eq=False)
class GeneratedRun:
    """A motion, and what moves like this.

    Parameters
    ----------
    title : str
        The edges that its first element takes, or what it holds where it turns.
    system : System
        The contact, called ``"contact"``, on a body.
    initial : mapping
        Initial values, as for `simulate`.
    t_start, t_end : float
        s.
    trace : Trace
        The run, as seen from the contact.
    """

    title: str
    system: System
    initial: Mapping[str, Any]
    t_start: float
    t_end: float
    trace: Trace = field(repr=False)

    def again(self, chart: Chart) -> Trace:
        """Run the same motion with another chart, such as one in which a guard is changed.

        Parameters
        ----------
        chart : Chart
            With the same names.

        Returns
        -------
        Trace
            As seen from the contact.

        Raises
        ------
        ChartError, ParameterError
            If its names are others.
        SimulationError
            If the run cannot continue.

        Examples
        --------
        >>> from gms_fsm.charts import CHARTS
        >>> run = generate(CHARTS["dog-clutch"]).runs[0]
        >>> bool((run.again(CHARTS["dog-clutch"]).t == run.trace.t).all())
        True
        """
        first, *others = self.system.machines
        own = with_chart(first, chart)
        kind = "contacts" if chart.velocities else "supervisors"
        changed: Any = {kind: (own, *others)}
        system = replace(self.system, **changed)
        trace = simulate(
            system, self.t_end, t_start=self.t_start, initial=self.initial, settings=SETTINGS
        )
        return trace.contact(CONTACT)

    def save(self, path: str | Path) -> Path:
        """Write it as a scenario file.

        Parameters
        ----------
        path : str or Path
            Ending in ``.toml``.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        more: dict[str, Any] = {"t_start": self.t_start, "initial": self.initial}
        start = Problem.of(self.system, None, self.t_end, SETTINGS, **more)
        return save_scenario(path, start, self.title, "Made by gms-fsm cover --generate.")


@dataclass(frozen=True)
class Unreached:
    """An edge, or a pair of edges, that no motion takes.

    Parameters
    ----------
    what : str
        Its name, with the state that it leaves: ``"engage from open, after disengage"``.
    verdict : {"proved", "open"}
        Whether it is proved that no run of any motion takes it.
    reason : str
        The argument, or why there is none.
    """

    what: str
    verdict: Literal["proved", "open"]
    reason: str


@dataclass(frozen=True, eq=False)
class Generated:
    """Motions that together try what is in a chart; `gms_fsm.generate` makes them.

    Parameters
    ----------
    runs : tuple of GeneratedRun
        None of them can be left out without showing less.
    coverage : Coverage
        What they reach together.
    pairs : Score
        How many pairs of edges that can follow each other in the graph they take.
    unreached : tuple of Unreached
        The edges and pairs that they do not take.
    bounds : mapping of str to tuple of float
        Within which initial values and signals are.
    seed : int
        Of the random part of the search.
    """

    runs: tuple[GeneratedRun, ...]
    coverage: Coverage
    pairs: Score
    unreached: tuple[Unreached, ...]
    bounds: Mapping[str, tuple[float, float]]
    seed: int

    @property
    def open(self) -> tuple[Unreached, ...]:
        """What is neither taken nor proved to be out of reach."""
        return tuple(each for each in self.unreached if each.verdict == "open")

    def __repr__(self) -> str:
        name, pairs = self.coverage.contact(CONTACT).chart.name, self.pairs
        said = f"{pairs.seen} of {pairs.of} pairs of edges, {len(self.open)} open"
        return f"<Generated: {len(self.runs)} motions of {name}; {said}>"

    def __str__(self) -> str:
        return "\n".join(_lines(self))

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write all motions as scenario files, which ``gms-fsm run`` and ``gms-fsm cover`` take.

        Parameters
        ----------
        folder : str or Path
            Created if it does not exist.

        Returns
        -------
        tuple of Path
            The files, ``motion_01.toml`` and so on.

        Raises
        ------
        OutputError
            If they cannot be written.
        """
        wide = max(2, len(str(len(self.runs))))
        names = [f"motion_{i:0{wide}}.toml" for i, _ in enumerate(self.runs, start=1)]
        into = output_folder(checked_path("folder", folder), names)
        return tuple(run.save(into / name) for run, name in zip(self.runs, names, strict=True))


@refusing()
def generate(
    chart: Chart | Model | Contact | System,
    contact: str = "",
    *,
    seed: int = 0,
    bounds: Mapping[str, tuple[float, float]] | None = None,
) -> Generated:
    """Find motions that take every edge of a chart, and every edge directly after every other one.

    Beyond that they show each comparison of each guard deciding (MC/DC), and hold it at the float
    where it turns. Every motion is a run of `simulate`: of the contact alone, on a body that
    is moved, or pushed if the chart locks it, strikes it or reads its acceleration.

    Parameters
    ----------
    chart : Chart, Model, Contact or System
        The chart. Alone it has the numbers of its demonstration, one of your own the first that
        its rules allow.
    contact : str
        The contact, of a system with several.
    seed : int
        Of the random part of the search; equal seeds give equal motions.
    bounds : mapping of str to (float, float), optional
        For velocity, position, variables, inputs and ``load``; by default what the guards and the
        scales of the model suggest.

    Returns
    -------
    Generated
        The motions, what they cover, and what they do not, with the reason.

    Raises
    ------
    ParameterError
        If there is no such contact, or a bound does not fit.

    Examples
    --------
    >>> from gms_fsm.charts import CHARTS
    >>> found = generate(CHARTS["dog-clutch"])
    >>> len(found.runs), found.coverage.scores["edges"], found.pairs
    (6, Score(seen=2, of=2), Score(seen=1, of=2))
    """
    if isinstance(chart, Chart):
        if contact:
            raise ParameterError(
                "a chart has no contacts", place="contact", value=contact, advice="leave it out"
            )
        own = any_contact(chart)
    else:
        own = contact_of(chart, contact)[0]
    stand = Stand(own)
    inner = _inner(bounds)
    guards = GuardPoints(own, MASS, inner, checked_integer("seed", seed), stand.drives)
    for name in inner:
        if name not in (known := [*_bounded(stand, guards)]):
            raise unknown("name", name, known, place="bounds")
    reasons = _never(own)
    search = MotionSearch(stand, guards, seed, reasons.keys())
    search.explore()
    chosen = _fewest(_candidates(stand, search)) or [_tried(stand, search.idle, search.strikes)]
    runs = tuple(_run(stand, each, search) for each in chosen)
    goals = goals_of(stand.chart)
    seen = set[Goal]().union(*(shown_by(each) for each in chosen))
    total = Coverage.merged(Coverage({CONTACT: of_view(run.trace)}) for run in runs)
    pairs = [goal for goal in goals if len(goal.edges) == 2]
    return Generated(
        runs,
        total,
        Score(sum(goal in seen for goal in pairs), len(pairs)),
        tuple(_unreached(goal, reasons, search) for goal in goals if goal not in seen),
        _bounds(stand, guards, search),
        seed,
    )


# --------------------------------------------------------------------------- bounds
def _inner(bounds: Mapping[str, tuple[float, float]] | None) -> dict[str, tuple[float, float]]:
    """Return bounds, checked."""
    found = {}
    for name, pair in mapping_of({} if bounds is None else bounds, "bounds").items():
        place = f"bounds[{name!r}]"
        try:
            low, high = pair
        except (TypeError, ValueError):
            raise ParameterError(
                "it must be two numbers, such as (-0.1, 0.1)", place=place, value=pair
            ) from None
        low, high = (checked_scalar(place, u, "finite") for u in (low, high))
        if not low <= high:
            raise ParameterError(
                "the first is larger than the second", place=place, value=pair, advice="swap them"
            )
        found[name] = (low, high)
    return found


def _bounded(stand: Stand, guards: GuardPoints) -> dict[str, str]:
    """Return the names that have bounds, each with the signal behind it, if there is one."""
    found = {name: "" for name in guards.free if name not in guards.loads}
    for v, signal in stand.drives.items():
        found[signal if stand.free else v] = signal
    return found | {name: name for name in stand.inputs}


def _bounds(
    stand: Stand, guards: GuardPoints, search: MotionSearch
) -> dict[str, tuple[float, float]]:
    found = {}
    for name, signal in _bounded(stand, guards).items():
        levels = [*guards.levels.get(name, ()), *search.sizes.levels.get(signal, ())]
        found[name] = (min(levels, default=0.0), max(levels, default=0.0))
    return found


# --------------------------------------------------------------------------- what is out of reach
def _never(contact: Contact) -> dict[Goal, str]:
    """Return the edges and pairs that are proved to be out of reach, and why."""
    chart = contact.chart
    if not chart.transitions or not numbers_fit(contact):
        return {}
    try:
        proofs = Nowhere(chart)
    except MissingExtraError:
        return {}
    edges = {Taken(each.name, each.source): each for each in chart.transitions}
    found = dict[Goal, str]()
    for goal in goals_of(chart):
        alone = [found[Goal((each,))] for each in goal.edges if Goal((each,)) in found]
        some = [edges[each] for each in goal.edges]
        reason = alone[0] if alone else proofs.edge(*some) if len(some) == 1 else proofs.pair(*some)
        if reason:
            found[goal] = reason
    return found


def _unreached(goal: Goal, reasons: Mapping[Goal, str], search: MotionSearch) -> Unreached:
    first, *others = reversed(goal.edges)
    what = f"{first.edge} from {first.source}" + "".join(f", after {each.edge}" for each in others)
    if goal in reasons:
        return Unreached(what, "proved", reasons[goal])
    if event := search.awaited(goal):
        return Unreached(what, "open", f"it waits for the event {event}, which no motion sends")
    return Unreached(what, "open", f"not proved, and not reached by {search.runs} runs")


# --------------------------------------------------------------------------- which are kept
def _candidates(stand: Stand, search: MotionSearch) -> list[tuple[Tried, Set[Goal]]]:
    """Return all motions worth keeping, run as they will be saved, with what they show."""
    points = [(motion, point, None) for point, motion in search.points]
    every = [*((motion, None, goal) for goal, motion in search.found.items()), *points]
    found: list[tuple[Tried, Set[Goal]]] = []
    for motion, point, goal in every:
        tried = _tried(stand, motion, search.strikes, point)
        seen = shown_by(tried)
        if goal is not None and goal not in seen:  # its end came too early
            tried = _tried(stand, motion.longer(HOLD), search.strikes)
            seen = shown_by(tried)
        if not tried.ended:
            found.append((tried, seen))
    return found


def _tried(stand: Stand, motion: Drive, striker: bool, point: TurningPoint | None = None) -> Tried:
    trace, ended = stand.run(motion, striker)
    return Tried(motion, trace, ended, firings_of(trace), point)


def _fewest(found: Sequence[tuple[Tried, Set[Goal]]]) -> list[Tried]:
    """Return motions of which none can be left out: those first that show most that is new."""
    left = set[Goal]().union(*(seen for _, seen in found))
    chosen: list[tuple[Tried, Set[Goal]]] = []
    while left:
        best = max(found, key=lambda each: len(each[1] & left))
        chosen.append(best)
        left -= best[1]
    for each in reversed(list(chosen)):
        others = set[Goal]().union(*(seen for tried, seen in chosen if tried is not each[0]))
        if each[1] <= others:
            chosen.remove(each)
    return [tried for tried, _ in chosen]


def _run(stand: Stand, tried: Tried, search: MotionSearch) -> GeneratedRun:
    motion = tried.motion
    system, initial = stand.system(motion, search.strikes), stand.initial(motion)
    return GeneratedRun(tried.title, system, initial, motion.t, motion.t_end, tried.trace)


# --------------------------------------------------------------------------- in words
def _lines(found: Generated) -> Iterator[str]:
    part = found.coverage.contact(CONTACT)
    scores = found.coverage.scores
    first = {name: scores[name] for name in ("states", "edges")}
    yield from lines({"": part}, {**first, "pairs": found.pairs, **scores})
    if found.unreached:
        yield "not taken:"
    for each in found.unreached:
        yield from wrapped(f"  {each.verdict:<6}  {each.what}: {each.reason}")
    limits = (f"{name} {low:.4g}..{high:.4g}" for name, (low, high) in found.bounds.items())
    yield from wrapped(f"within {', '.join(limits)} (SI units); seed {found.seed}")
