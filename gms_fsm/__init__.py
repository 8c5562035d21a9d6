"""gms-fsm: friction as an explicit state machine.

The Generalized Maxwell Slip model, every element a `transitions` machine with guarded stick/slip
edges, run by fixed- or adaptive-step integrators with located crossings.

>>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
>>> trace = simulate(GMS(GMSParameters.paper("stick-slip"), law="published"),
...                  Prescribed("0.15*sin(2*pi*t/25)"), 20.0)
>>> [str(edge) for edge in trace.transitions.edge[:4]]
['break_away_forward', 'break_away_forward', 'break_away_forward', 'break_away_forward']
"""

from gms_fsm.chart import Chart, State, Transition
from gms_fsm.errors import GMSError, SimulationError
from gms_fsm.machines import Element, ElementMachines
from gms_fsm.models import GMS, ChartModel, LuGre
from gms_fsm.parameters import GMSParameters, Stribeck
from gms_fsm.prove import Finding, Report, prove
from gms_fsm.rigs import Prescribed, PulledSlider, Slider
from gms_fsm.session import Session
from gms_fsm.simulate import simulate
from gms_fsm.sweep import Sweep, sweep
from gms_fsm.trace import Trace

__version__ = "0.1.0"

__all__ = [
    "GMS",
    "Chart",
    "ChartModel",
    "Element",
    "ElementMachines",
    "Finding",
    "GMSError",
    "GMSParameters",
    "LuGre",
    "Prescribed",
    "PulledSlider",
    "Report",
    "Session",
    "SimulationError",
    "Slider",
    "State",
    "Stribeck",
    "Sweep",
    "Trace",
    "Transition",
    "prove",
    "simulate",
    "sweep",
]
