"""gms-fsm: friction as an explicit state machine.

The Generalized Maxwell Slip model, with every element a `transitions` machine with guarded
stick/slip edges, run by fixed- or adaptive-step integrators with located crossings.

The names below are imported lazily, on first access.

>>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
>>> trace = simulate(GMS(GMSParameters.paper("stick-slip"), law="published"),
...                  Prescribed("0.15*sin(2*pi*t/25)"), 20.0)
>>> [str(edge) for edge in trace.transitions.edge[:4]]
['break_away_forward', 'break_away_forward', 'break_away_forward', 'break_away_forward']
"""

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

from gms_fsm import _neighbours as _neighbours
from gms_fsm._version import __version__ as __version__

if TYPE_CHECKING:
    from gms_fsm.analysis.cycles import LimitCycle as LimitCycle
    from gms_fsm.analysis.cycles import limit_cycle as limit_cycle
    from gms_fsm.charts.chart import Chart as Chart
    from gms_fsm.charts.chart import State as State
    from gms_fsm.charts.chart import Transition as Transition
    from gms_fsm.charts.parameters import Parameter as Parameter
    from gms_fsm.charts.stribeck import Stribeck as Stribeck
    from gms_fsm.coupling.bank import FrictionBank as FrictionBank
    from gms_fsm.coupling.compensator import Compensator as Compensator
    from gms_fsm.coupling.equations import FrictionEquations as FrictionEquations
    from gms_fsm.coupling.stepping import FrictionState as FrictionState
    from gms_fsm.coupling.system_state import SystemState as SystemState
    from gms_fsm.difference.diff import Diff as Diff
    from gms_fsm.difference.diff import diff as diff
    from gms_fsm.errors import ChartError as ChartError
    from gms_fsm.errors import CheckpointError as CheckpointError
    from gms_fsm.errors import ExpressionError as ExpressionError
    from gms_fsm.errors import GMSError as GMSError
    from gms_fsm.errors import MissingExtraError as MissingExtraError
    from gms_fsm.errors import OutputError as OutputError
    from gms_fsm.errors import ParameterError as ParameterError
    from gms_fsm.errors import RecordError as RecordError
    from gms_fsm.errors import ScenarioError as ScenarioError
    from gms_fsm.errors import SessionError as SessionError
    from gms_fsm.errors import SignalError as SignalError
    from gms_fsm.errors import TraceFileError as TraceFileError
    from gms_fsm.errors import UnitError as UnitError
    from gms_fsm.exporters import export as export
    from gms_fsm.generation.generate import Generated as Generated
    from gms_fsm.generation.generate import generate as generate
    from gms_fsm.identification.bank import initial_bank as initial_bank
    from gms_fsm.identification.choose import choose as choose
    from gms_fsm.identification.excite import excite as excite
    from gms_fsm.identification.fit import fit as fit
    from gms_fsm.identification.result import Fit as Fit
    from gms_fsm.linear.describing import describing_function as describing_function
    from gms_fsm.linear.linearize import linearize as linearize
    from gms_fsm.phenomena.measure import Bench as Bench
    from gms_fsm.phenomena.measure import PhenomenaTable as PhenomenaTable
    from gms_fsm.phenomena.measure import measure_phenomena as measure_phenomena
    from gms_fsm.records.record import Record as Record
    from gms_fsm.run.machines import Element as Element
    from gms_fsm.run.machines import ElementMachines as ElementMachines
    from gms_fsm.run.repeated.prepare import Prepared as Prepared
    from gms_fsm.run.repeated.prepare import prepare as prepare
    from gms_fsm.run.settings import Settings as Settings
    from gms_fsm.run.simulate import simulate as simulate
    from gms_fsm.run.sweep import Sweep as Sweep
    from gms_fsm.run.sweep import sweep as sweep
    from gms_fsm.session.coverage import coverage as coverage
    from gms_fsm.session.session import Session as Session
    from gms_fsm.systems.gms_parameters import GMSParameters as GMSParameters
    from gms_fsm.systems.models import GMS as GMS
    from gms_fsm.systems.models import ChartModel as ChartModel
    from gms_fsm.systems.models import LuGre as LuGre
    from gms_fsm.systems.models import Model as Model
    from gms_fsm.systems.rigs import Belt as Belt
    from gms_fsm.systems.rigs import Prescribed as Prescribed
    from gms_fsm.systems.rigs import PulledSlider as PulledSlider
    from gms_fsm.systems.rigs import Rig as Rig
    from gms_fsm.systems.rigs import Slider as Slider
    from gms_fsm.systems.signals import Signal as Signal
    from gms_fsm.systems.system import Body as Body
    from gms_fsm.systems.system import Contact as Contact
    from gms_fsm.systems.system import Sampled as Sampled
    from gms_fsm.systems.system import Spring as Spring
    from gms_fsm.systems.system import Supervisor as Supervisor
    from gms_fsm.systems.system import System as System
    from gms_fsm.traces.coverage.total import Coverage as Coverage
    from gms_fsm.traces.failures import CallbackError as CallbackError
    from gms_fsm.traces.failures import LivelockError as LivelockError
    from gms_fsm.traces.failures import LockError as LockError
    from gms_fsm.traces.failures import NotFiniteError as NotFiniteError
    from gms_fsm.traces.failures import NotUniqueError as NotUniqueError
    from gms_fsm.traces.failures import SignalEndError as SignalEndError
    from gms_fsm.traces.failures import SimulationError as SimulationError
    from gms_fsm.traces.failures import StepLimitError as StepLimitError
    from gms_fsm.traces.failures import StepSizeError as StepSizeError
    from gms_fsm.traces.trace import Trace as Trace
    from gms_fsm.verification.prove import Finding as Finding
    from gms_fsm.verification.prove import Report as Report
    from gms_fsm.verification.prove import prove as prove

# The same names again, for run time; type checkers read those above. A test keeps the two in step.
_HOMES = {
    "analysis.cycles": "LimitCycle limit_cycle",
    "charts.chart": "Chart State Transition",
    "charts.parameters": "Parameter",
    "charts.stribeck": "Stribeck",
    "difference.diff": "Diff diff",
    "errors": "ChartError CheckpointError ExpressionError GMSError MissingExtraError OutputError "
    "ParameterError RecordError ScenarioError SessionError SignalError TraceFileError UnitError",
    "exporters": "export",
    "generation.generate": "Generated generate",
    "identification.bank": "initial_bank",
    "identification.choose": "choose",
    "identification.excite": "excite",
    "identification.fit": "fit",
    "identification.result": "Fit",
    "linear.describing": "describing_function",
    "linear.linearize": "linearize",
    "verification.prove": "Finding Report prove",
    "session.coverage": "coverage",
    "session.session": "Session",
    "phenomena.measure": "Bench PhenomenaTable measure_phenomena",
    "records.record": "Record",
    "coupling.bank": "FrictionBank",
    "coupling.compensator": "Compensator",
    "coupling.equations": "FrictionEquations",
    "run.machines": "Element ElementMachines",
    "run.repeated.prepare": "Prepared prepare",
    "run.settings": "Settings",
    "run.simulate": "simulate",
    "coupling.stepping": "FrictionState",
    "coupling.system_state": "SystemState",
    "run.sweep": "Sweep sweep",
    "systems.gms_parameters": "GMSParameters",
    "systems.models": "ChartModel GMS LuGre Model",
    "systems.rigs": "Belt Prescribed PulledSlider Rig Slider",
    "systems.signals": "Signal",
    "systems.system": "Body Contact Sampled Spring Supervisor System",
    "traces.coverage.total": "Coverage",
    "traces.failures": "CallbackError LivelockError LockError NotFiniteError NotUniqueError "
    "SignalEndError SimulationError StepLimitError StepSizeError",
    "traces.trace": "Trace",
}
_HOME = {name: home for home, names in _HOMES.items() for name in names.split()}

__all__ = sorted(_HOME)

if "IPython" in sys.modules:  # else this is no notebook
    from gms_fsm.foundation.display import register_figures

    register_figures()


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        from gms_fsm.foundation.arguments import meant

        hint = "" if name.startswith("_") else meant(name, _HOME).strip()
        said = f"module 'gms_fsm' has no attribute {name!r}"
        raise AttributeError(f"{said}; {hint}" if hint else said)
    found = getattr(import_module(f"gms_fsm.{_HOME[name]}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})
