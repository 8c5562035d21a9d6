"""simulate(): run a model on a rig by its state machines."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Unpack

import integrators
from gms_fsm.errors import ParameterError, SignalError
from gms_fsm.foundation.arguments import checked_path, refusing
from gms_fsm.foundation.extras import has_machine_code
from gms_fsm.gradients.directions import Directions, directions_of
from gms_fsm.gradients.following import followed_in_python
from gms_fsm.gradients.sensitivities import Sensitivities
from gms_fsm.gradients.tangents import refuse_callables
from gms_fsm.lowering.program import equations, refuse_functions
from gms_fsm.run._checkpoint import Checkpointer
from gms_fsm.run.machines import ElementMachines, IfElse, Interference, MachineEngine
from gms_fsm.run.problem import Problem
from gms_fsm.run.recording.compiled_run import CompiledRun
from gms_fsm.run.recording.counted import CountTables, RowCounter, of_every_step
from gms_fsm.run.recording.moment import Moment, Recording
from gms_fsm.run.recording.own_machines import engine_of, own_machines
from gms_fsm.run.recording.pace import LATER, PATIENCE, check_pace
from gms_fsm.run.recording.ready_code import tangents_of
from gms_fsm.run.recording.recording import Recorder, check_end, explained, interference_error
from gms_fsm.run.recording.until import SeenUntil, Until
from gms_fsm.run.repeated.again import runs_like
from gms_fsm.run.settings import RunOptions, SettingOptions, Settings
from gms_fsm.run.stepped.controlled import controlled
from gms_fsm.systems.models import Model
from gms_fsm.systems.mounted import arguments_of, mounted, with_inputs
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.signals import SignalLike
from gms_fsm.systems.system import System
from gms_fsm.traces.failures import SimulationError
from gms_fsm.traces.monitors import Monitor, checked, watched
from gms_fsm.traces.trace import Trace
from integrators import Arc, HybridError, Tableau, hybrid

__all__ = ["Moment", "Run", "simulate"]


@refusing(rig="simulate(model, rig, t_end), or simulate(system, t_end)")
def simulate(
    model: Model | System,
    rig: Rig | float,
    t_end: float | None = None,
    *,
    t_start: float = 0.0,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, SignalLike] | None = None,
    settings: Settings | None = None,
    engine: str | ElementMachines | None = None,
    machines: ElementMachines | Mapping[str, ElementMachines] | None = None,
    progress: Callable[[Moment], object] | None = None,
    checkpoint: str | Path | None = None,
    checkpoint_every: float = 60.0,
    monitors: str | Iterable[str | Monitor] = (),
    until: str | None = None,
    sensitivities: Iterable[str] = (),
    **options: Unpack[RunOptions],
) -> Trace:
    """Run a friction model on a rig, or a system: ``simulate(system, t_end)``.

    The driver evaluates the guards, freezes the states, integrates until a watched comparison
    changes its truth value, and evaluates the guards again.

    Parameters
    ----------
    model : GMS, LuGre, ChartModel or System
        Friction model to simulate; or a system of bodies and contacts.
    rig : Prescribed, Slider or PulledSlider
        The rig it is mounted on; a system has none.
    t_end, t_start : float
        s.
    initial : mapping, optional
        Any of the chart's variables by name, for example ``z`` (n,) [m], ``states`` (n,) names,
        ``v`` [m/s] (not with a prescribed velocity) and ``x`` [m]. In a system ``"load.x"`` is the
        position of the body load, ``"gear.z"`` and ``"gear.states"`` belong to the contact gear,
        and further states have their names. All else starts at 0.
    inputs : mapping of str to signal, optional
        For each input of a system what it is during the run: an expression, ramps, a record, a
        function; see `System.with_inputs`.
    settings : Settings, optional
        How to integrate and what to record; the defaults if omitted.
    engine : {"machines", "ifelse", "compiled"} or ElementMachines, optional
        Field of `Settings`. Your own machines, with callbacks, may be given instead of
        ``"machines"``.
    machines : ElementMachines or mapping of str to ElementMachines, optional
        Your own machines; with the compiled engine each firing is replayed through them, so that
        callbacks run and their states are correct at the end. In a system by contact:
        ``{"gear": ElementMachines(system.contact("gear"))}``.
    progress : callable, optional
        Called at intervals with the `Moment` reached, and at the end.
    checkpoint : str or Path, optional
        A file for the state of a long run, written at intervals. If it exists when the run starts,
        the run continues from it, bit for bit as if it had not been interrupted; at the end the
        file is removed. A signal may be a Python function over plain values: a changed function is
        refused.
    checkpoint_every : float
        Wall-clock time in s between two checkpoints.
    monitors : str or iterable of str or Monitor
        Checks of the run: ``"chattering"``, ``"passivity"``, ``"coverage"``, ``"all"`` of these,
        invariants such as ``"abs(z) <= 2*s"``, or objects from `gms_fsm.traces.monitors`; in a
        system also those of one contact, such as ``"gear: passivity"``. Their
        verdicts are in ``Trace.monitors``. They examine the rows and the log after the run has
        ended or failed.
    until : str, optional
        A condition, such as ``"v > 0.2 and t > 1"`` or ``"count(slip) == 4"``: the run ends where
        it becomes true, located as a switch, and at t_end at the latest. It may read what a text of
        the system may, of a model on a rig also F and, of a single element, its variables. If it
        is true at the start it must first become false.
    sensitivities : iterable of str
        Numbers by name, as in a sweep (``"k_1"``, ``"gear.F_s"``), and initial values
        (``"initial.v"``, ``"initial.z2"``): `Trace.sensitivity` has the derivatives by them. The
        compiled engine computes them as it runs; others run once more for them, in machine code
        where that is installed. Rows and log keep their bits.
    **options
        Fields of `Settings` by name, which override those of `settings`: ``method``, ``step``,
        ``rtol``, ``atol``, ``max_step``, ``max_steps``, ``events``, ``output``, ``t_eval``.

    Returns
    -------
    Trace
        Rows, transition log, and the model, rig and settings that produced them.

    Raises
    ------
    ParameterError, SignalError
        If an argument violates its rule.
    CheckpointError
        If the checkpoint belongs to another run or another program, or is damaged.
    OutputError
        If a checkpoint is requested and cannot be written.
    SimulationError
        If the run cannot continue (`LivelockError`, `StepSizeError`, `StepLimitError`,
        `NotFiniteError`, `SignalEndError`, `CallbackError`); its ``trace`` has the part before.
    KeyboardInterrupt
        On Ctrl-C; its ``trace`` has the part before, possibly without any rows.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> trace = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"),
    ...                  Prescribed("0.2*sin(2*pi*t/20)"), 61.0)
    >>> len(trace.transitions)
    48
    """
    engine, machines = _given(engine, machines)
    given: SettingOptions = {**options} if engine is None else {**options, "engine": engine}  # type: ignore[typeddict-item]
    chosen = Settings.of(settings, "simulate", **given)
    on, end = arguments_of("simulate", model, rig, t_end)
    if inputs is not None:
        model = with_inputs(model, inputs)
    if progress is not None and not callable(progress):
        raise ParameterError(
            "it must be a function of the moment reached", place="progress", value=progress
        )
    if wish := is_asked(sensitivities):
        refuse_functions(model)  # what they return depends on the numbers, too
    model = controlled(model, end, chosen, t_start=t_start, initial=initial)
    path = None if checkpoint is None else checked_path("checkpoint", checkpoint)
    if machines is not None and chosen.engine == "ifelse":
        raise ParameterError("engine 'ifelse' uses no machines", advice="leave machines=... out")
    what = mounted(model, on, chosen.held_period)
    special = initial, machines, progress, path, until, monitors or None, wish or None
    like = runs_like(what, t_start, end, chosen, special)
    if like is not None and (again := like.trace(what)) is not None:
        return again
    start = Problem.on(what, end, chosen, t_start=t_start, initial=initial)
    watching = checked(monitors, start.what, start.output).values() if monitors else ()
    wanted = asked_for(start, sensitivities, until)
    own = {} if machines is None else own_machines(machines, start)
    stop = None if until is None else Until.of(start, until)
    if stop is not None:
        start = stop.start
    along = wanted if path is None else None  # a checkpoint has no tangents
    run: CompiledRun | Run = (
        CompiledRun(start, engine_of(start, own) if own else None, wanted=along)
        if chosen.engine == "compiled"
        else Run(start, own)
    )
    seen: Recording = run.recorder if stop is None else SeenUntil(stop, run.recorder)
    keeper = None if path is None else Checkpointer(run, path, checkpoint_every)
    try:
        while run.advance() and not (stop and stop.over(run.recorder)):
            if keeper is not None:
                keeper.look()
            if progress is not None:
                progress(Moment(seen))
        if progress is not None:
            progress(Moment(seen))
    except SimulationError as error:
        error.trace = error.trace if stop is None else stop.trace(error.trace)
        if watching:
            error.trace = watched(error.trace, watching, error)
        raise
    except KeyboardInterrupt as error:
        error.trace = seen.trace()  # type: ignore[attr-defined]
        raise
    if keeper is not None:
        keeper.finish()
    if like is not None:
        like.keep(start)
    trace = seen.trace()
    if wanted is not None:
        trace = replace(trace, derived=derived(run, wanted))
    return watched(trace, watching) if watching else trace


def _given(engine: Any, machines: Any) -> tuple[Any, Any]:
    """Return an engine's name, and the user's machines, which may be given as the engine."""
    if not isinstance(engine, ElementMachines):
        return engine, machines
    if machines is not None:
        raise ParameterError(
            "engine and machines are both machines", advice="give only one of them"
        )
    return "machines", engine


def simulated(start: Problem, until: str | None = None, wanted: Directions | None = None) -> Trace:
    """Run a problem as it stands, to its end or until a condition becomes true."""
    stop = None if until is None else Until.of(start, until)
    start = start if stop is None else stop.start
    compiled = start.chosen.engine == "compiled"
    run = CompiledRun(start, wanted=wanted) if compiled else Run(start)
    while run.advance() and not (stop and stop.over(run.recorder)):
        pass
    found = run.recorder.trace()
    if wanted is not None:
        found = replace(found, derived=derived(run, wanted))
    return found if stop is None else stop.trace(found)


def is_asked(sensitivities: Iterable[str]) -> bool:
    """Return whether a run is to be differentiated."""
    return not isinstance(sensitivities, list | tuple) or len(sensitivities) > 0


def asked_for(
    start: Problem, sensitivities: Iterable[str], until: str | None = None
) -> Directions | None:
    """Return by what a run is to be differentiated, if it is; refuse what has no derivative."""
    if not is_asked(sensitivities):
        return None
    check_derivable(start.chosen, until)
    refuse_callables(start.program)
    return directions_of(start.what, start.program, start.y, sensitivities)


def derived(run: CompiledRun | Run, directions: Directions) -> Sensitivities:
    """Return the derivatives of a run that has reached its end: those followed, or once more.

    Python follows tangents only where nothing else can: a run once more in machine code takes a
    tenth of the time.
    """
    followed = run.columns.derived() if isinstance(run, CompiledRun) else None
    if followed is None:
        start = run.start
        if not has_machine_code() or not isinstance(start.options.method, Tableau):
            begin = start.t_start, start.y, start.mode, start.last
            once_more = followed_in_python(tangents_of(start, directions), start.options, begin)
            return Sensitivities(directions, once_more)
        again = CompiledRun(start, wanted=directions)
        while again.advance():
            pass
        followed = again.columns.derived()
        assert followed is not None
    return followed


def check_derivable(chosen: Settings, until: str | None = None) -> None:
    """Refuse settings whose results have no derivative."""
    if chosen.events != "located":
        raise ParameterError(
            "where switches are not located, results jump with the numbers",
            place="events",
            value=chosen.events,
            advice="leave events out, or sensitivities",
            key=("sensitivities",),
        )
    if until is not None:
        raise ParameterError(
            "a run that ends by a condition has no fixed end",
            place="until",
            value=until,
            advice="give t_end, and read sensitivity('transitions', ...) of a supervisor",
            key=("sensitivities",),
        )


class Run:
    """A simulation in progress, which `simulate` drives to its end and a session step by step.

    Parameters
    ----------
    start : Problem
        The run to perform; for the engine ``"compiled"``, machines run it, with the same result.
    machines : mapping of str to ElementMachines, optional
        The user's own machines, by contact.
    tables : CountTables, optional
        Where every step's row is counted; such a run keeps only its end.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> run = Run(Problem.of(model, Prescribed("0.2"), 3.0, rows_at_once=1))
    >>> run.advance(), len(run.recorder.trace())
    (True, 1)
    """

    def __init__(
        self,
        start: Problem,
        machines: Mapping[str, ElementMachines] | None = None,
        tables: CountTables | None = None,
    ) -> None:
        self.counter: RowCounter | None = None
        if tables is not None:
            start, self.counter = of_every_step(start), RowCounter(tables, start.program.p)
        self.start = start
        switch: MachineEngine | IfElse = IfElse(start.program)
        self.engine: MachineEngine | None = None
        if start.chosen.engine != "ifelse":
            switch = self.engine = engine_of(start, machines or {})
        self.recorder, self.next_look = Recorder(start, self.counter), PATIENCE
        self.event: integrators.Event | None = None  # the latest
        made, options = equations(start.program), start.options
        self.buffers = hybrid.buffers(made, start.t_start, start.y, start.mode, start.last, options)
        self.events = hybrid.events(made, switch, self.buffers, options)

    @property
    def rows_wait(self) -> bool:
        """Whether the next event brings rows that are in the buffers only: the one of a tick."""
        return self.buffers.out.row > 0

    def kept(self) -> dict[str, Any]:
        """Return the recorder's contents for a checkpoint."""
        return self.recorder.state()

    def restore(self, kept: dict[str, Any]) -> None:
        """Restore what `kept` returned; the buffers are already filled."""
        now = self.buffers.now
        t, y = now.t, list(now.y)
        self.recorder.restore(kept, (t, y, hybrid.modes_of(self.buffers)))
        if self.engine is not None:
            self.engine.restore(t, list(y), now.mode)

    def advance(self) -> bool:
        """Advance to the next event.

        Returns
        -------
        bool
            False if the run has reached its end.

        Raises
        ------
        SimulationError
            If it cannot continue.
        """
        recorder = self.recorder
        try:
            event = next(self.events, None)
        except HybridError as error:
            recorder.latest = error.t, error.y, error.mode
            raise explained(error, recorder) from None
        except SignalError as error:
            raise SimulationError(
                error.reason, recorder.trace(), place=error.place, advice=error.advice
            ) from None
        except KeyboardInterrupt:  # within a step; the previous rows may have taken an hour
            if self.buffers.out.row:
                recorder.take(hybrid.take_rows(self.buffers))
            raise
        except Interference as error:
            raise interference_error(error, recorder) from error.__cause__
        if event is None:
            check_end(recorder)
            return False
        self.event = event
        recorder.take(event)
        if isinstance(event, Arc) and self.buffers.out.steps >= self.next_look:
            self.next_look = LATER * self.buffers.out.steps
            check_pace(recorder, self.buffers)
        return True
