"""Everything the product refuses, in one table of calls.

A group makes calls of one kind; a row is what one call is given. `tests/test_refusals.py` makes the
calls and compares class, place, value and message of their errors with
`tests/refusals.approved.txt`, which ``python -m tests.refusals`` writes anew. A new refusal is a
row.
"""

from __future__ import annotations

import dataclasses
import io
import json
import os
import re
import tempfile
from collections.abc import Callable, Mapping
from contextlib import chdir
from functools import cache, partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest import mock

import numpy as np
import scipy.integrate
from scipy.integrate import RK45
from transitions import Machine
from transitions import State as MachineState
from transitions.extensions.asyncio import AsyncMachine
from transitions.extensions.nesting import HierarchicalMachine
from transitions.extensions.states import Error, Timeout, Volatile, add_state_features

from gms_fsm import (
    GMS,
    Body,
    Chart,
    ChartModel,
    Compensator,
    Contact,
    Coverage,
    Element,
    ElementMachines,
    FrictionBank,
    FrictionEquations,
    FrictionState,
    GMSError,
    GMSParameters,
    LuGre,
    Parameter,
    Prescribed,
    PulledSlider,
    Record,
    Sampled,
    Session,
    Slider,
    Spring,
    State,
    Stribeck,
    Supervisor,
    Sweep,
    System,
    SystemState,
    Trace,
    Transition,
    choose,
    coverage,
    describing_function,
    diff,
    excite,
    export,
    fit,
    generate,
    initial_bank,
    limit_cycle,
    linearize,
    measure_phenomena,
    prove,
    simulate,
    sweep,
)
from gms_fsm.app.cli import CliOptions, app
from gms_fsm.app.scenario import launched, load_scenario, load_system
from gms_fsm.charts import CHARTS, gms_element, timetable
from gms_fsm.charts.registry import Demonstration, Entry, entry
from gms_fsm.debugger.dap._adapter import Adapter
from gms_fsm.debugger.dap._wire import read_message
from gms_fsm.errors import NOTHING, shown
from gms_fsm.foundation.quantities import factor
from gms_fsm.identification.certainty.intervals import Bootstrap
from gms_fsm.phenomena.results import PhenomenaTable, PhenomenonResult
from gms_fsm.records import _table, damper, tribometer
from gms_fsm.systems.mounted import mounted
from gms_fsm.systems.signals import as_signal
from gms_fsm.systems.system import with_model
from gms_fsm.traces.monitors import Chattering, CoverageMonitor, Passivity
from tests import older_files, own_files, systems_cases
from tests.corpus import HEALS, run, trace
from tests.exporters.charts_to_export import FOREIGN, TEXTS, edited_export, foreign, one_edge, small
from tests.helpers import FIG4_SINE, ROOT, pulled_mass, stick_slip
from tests.inspection.sessions import a_system, fig4, locked
from tests.scenario_files import MEASURED, OPEN_LOOP, changed, sine_table, table

APPROVED = ROOT / "tests" / "refusals.approved.txt"
# What other libraries say differs with their versions; a new chart, format or lesson is in a list.
VARYING = (
    r"(?<=not valid TOML: )[^;]*",
    r"(?<=Invalid JSON: ).*?(?=\); )",
    r"(?<=is not JSON: ).*?(?=\); )",
    r"\[Errno .*",
    r"embedded null[^)]*",
    r"(?<=must be one of )backlash,.*",
    r"(?<=there are )(backlash|break-away),.*",
    r"(?<=must end in )\.(svg|png),.*",
    r"(?<=give one of )(\.mmd|c99),.*",
    r"(?<=choose one of)\n[\s\S]*",
)
LONG = "x" * 50_000
NAN, INF = np.nan, np.inf


REFUSALS: dict[str, Callable[[], object]] = {}


def group(what: str, call: Callable[..., object], rows: Mapping[str, Any]) -> None:
    """Add rows to the table: what the call is given, as a tuple unless it is one argument."""
    for name, row in rows.items():
        assert f"{what}: {name}" not in REFUSALS
        REFUSALS[f"{what}: {name}"] = partial(call, *(row if isinstance(row, tuple) else (row,)))


def refused(call: Callable[[], object]) -> tuple[GMSError | None, set[str]]:
    """Return the error of a call in an empty folder, and the files that are there afterwards."""
    others = {name: value for name, value in os.environ.items() if name != "GMS_FSM_DATA"}
    with (
        tempfile.TemporaryDirectory() as folder,
        chdir(folder),
        mock.patch.dict(os.environ, others, clear=True),
    ):
        try:
            call()
        except GMSError as error:
            return error, {path.as_posix() for path in Path().rglob("*") if path.is_file()}
    return None, set()


def called(make: Callable[[], object]) -> object:
    """Call it."""
    return make()


def told(error: GMSError | None) -> str:
    """Return the class, place and value of an error, then its message without what varies."""
    if error is None:
        return "not refused"
    at = ": ".join(filter(None, (error.outer, error.place)))
    value = "" if error.value is NOTHING else f" is {shown(error.value)}"
    said = f"{type(error).__name__} at {at!r}{value}\n{error}".replace("\0", "\\0")
    for pattern in VARYING:
        said = re.sub(pattern, "...", said)
    return said.replace("\n", "\n    ")


def transcript() -> str:
    """Return what is told of all refusals."""
    found = ((name, told(refused(call)[0])) for name, call in REFUSALS.items())
    return "".join(f"{name}\n    {said}\n" for name, said in found)


@cache
def approved() -> dict[str, str]:
    """Return the approved message of each refusal."""
    found = re.split(r"^(?=\S)", APPROVED.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {name: said[:-1] for name, _, said in (each.partition("\n    ") for each in found[1:])}


# --------------------------------------------------------------------------- the command line
def verb(*arguments: str) -> None:
    """Call ``gms-fsm``, and let its error pass."""
    app(arguments, obj=CliOptions(), standalone_mode=False)


def scenario(text: str | bytes, *overrides: str) -> None:
    """Run a scenario file with these contents."""
    Path("a.toml").write_bytes(text.encode() if isinstance(text, str) else text)
    verb("run", "a.toml", "-o", "out", *(each for set_ in overrides for each in ("--set", set_)))


def edited(old: str, new: str) -> None:
    """Run the open loop, edited."""
    scenario(changed(OPEN_LOOP, old, new))


MODEL = OPEN_LOOP[OPEN_LOOP.index("[model]") : OPEN_LOOP.index("[rig]")]
RIG = OPEN_LOOP[OPEN_LOOP.index("[rig]") : OPEN_LOOP.index("[run]")]
PAPER = '[model]\nkind = "GMS"\nlaw = "signed"\npreset = "stick-slip"\n'
SIN, END, ONE_C = "0.1*sin(t)", "t_end = 1.0", "C = [0.1, 0.1]"
QUOTED = f'"{SIN}"'
PULLED = '[rig]\nkind = "pulled"\nmass = 1.0\nstiffness = -5.0\nspeed = 0.1\n'
COLUMN = 'time = { column = "t", unit = "s" }'
SIGNAL = f'{{ file = "%s", {COLUMN}, value = {{ column = "x", unit = "m" }} }}'

rows = {
    "typo of a table": ("[rig]", "[rgi]"),
    "typo": ("v_c = 1e-6", "vc = 1e-6"),
    "typo of a required key": ("law =", "lwa ="),
    "typo two tables deep": ("F_s = 1.5", "Fs = 1.5"),
    "unknown": (END, f"{END}\nspeed_of_light = 3e8"),
    "of another rig": ('kind = "prescribed"', 'kind = "pulled"'),
    "of another model": ('"GMS"', '"LuGre"'),
    "of another rig beside one's own": (QUOTED, f"{QUOTED}\nspeed = 0.1"),
    "called float": (END, f"{END}\nfloat = 1"),
    "typo in a measured signal": (QUOTED, f'{{ file = "a.csv", {COLUMN}, valeu = 1 }}'),
    "record that no rig uses": ("[run]", f'[record]\nfile = "a.csv"\n{COLUMN}\n[run]'),
    "rig that wants a record": (RIG, '[rig]\nkind = "record"\n'),
    "no model": (MODEL, ""),
    "no law": ('law = "signed"\n', ""),
    "no end": (END, ""),
    "no v_s": (", v_s = 1e-3", ""),
    "no kind of rig": ('kind = "prescribed"\n', ""),
    "no stiffness": ("k = [100.0, 50.0]\n", ""),
    "very long": ('title = "open loop"', f'"{LONG}" = 1'),
    "very long value": (END, f"{END}\nend = '{LONG}'"),
    "3000 tables deep": ("[run]", f"{'a.' * 3000}b = 1\n[run]"),
    "of a table within": ("v_c = 1e-6", "v_c = 1e-6\nF_c = 1.0"),
    "of another program": (END, f"{END}\ndt = 1e-3"),
    "no C": (f"{ONE_C}\n", ""),
    "no head of the model": ("[model]\n", ""),
}
group("key of a scenario", edited, rows)
rows = {
    "unknown model": ('"GMS"', '"GSM"'),
    "model in other letters": ('"GMS"', '"gms"'),
    "model with a hyphen": ('"GMS"', '"lu-gre"'),
    "number with its unit": (END, 't_end = "60 s"'),
    "number with another unit": ("v_c = 1e-6", 'v_c = "1e-3 mm/s"'),
    "number with a unit below the line": ("v_c = 1e-6", 'v_c = "2 N/mm"'),
    "number with an unknown unit": ("v_c = 1e-6", 'v_c = "5 apples"'),
    "formula for a number": (END, 't_end = "2*t"'),
    "number of zero": ("v_c = 1e-6", "v_c = 0"),
    "list for a table": ("{ F_c = 1.0, F_s = 1.5, v_s = 1e-3 }", "[1.0, 1.5, 1e-3]"),
    "decimal commas in a list": (ONE_C, "C = [0,1, 0,1]"),
    "numbers in a text": ("[100.0, 50.0]", '"100, 50"'),
    "unknown law": ('"signed"', '"singed"'),
    "unknown column of Table I": (MODEL, PAPER.replace("stick-slip", "stickslip")),
    "unknown method": (END, f'{END}\nmethod = "rk45"'),
    "unknown picture format": ("figures = []", 'figures = ["jpg"]'),
    "very long kind": ('kind = "GMS"', f'kind = "{LONG}"'),
    "text for a number": ("v_c = 1e-6", 'v_c = "1e-6"'),
    "text in a list": ("[100.0, 50.0]", '[100.0, "50"]'),
    "number for a list": ("[100.0, 50.0]", "100.0"),
    "true for a number": (END, "t_end = true"),
    "value for a table": (MODEL, "model = 3\n"),
    "list of tables for a table": ("[rig]", "[[rig]]"),
    "date for a signal": (QUOTED, "2020-01-01"),
    "NaN": ("v_c = 1e-6", "v_c = nan"),
    "negative step": (END, f"{END}\nstep = -0.1"),
    "negative stiffness": ("[100.0, 50.0]", "[100.0, -50.0]"),
    "less stiction than friction": ("F_s = 1.5", "F_s = 0.5"),
    "negative row distance": ("figures = []", "every = -1.0"),
    "too many C": ("[0.1, 0.1]", "[0.1, 0.1, 0.1]"),
    "preset and parameters": (MODEL, PAPER + "v_c = 1e-6\n"),
    "shares that are not everything": (ONE_C, "C = 2.0\nshares = [0.5, 0.4]"),
    "negative share": (ONE_C, "C = 2.0\nshares = [1.5, -0.5]"),
    "shares with a list of C": (ONE_C, f"{ONE_C}\nshares = [0.5, 0.5]"),
    "one C for all": (ONE_C, "C = 2.0"),
    "corner of three numbers": (QUOTED, "[[0.0, 0.0, 1.0], [1.0, 1.0, 2.0]]"),
    "number of 5000 digits": (END, f"t_end = 1{'0' * 5000}"),
    "number without a digit before the point": ("[100.0, 50.0]", "[100.0, -.5e-3]"),
    "number without a digit behind the point": (END, "t_end = 1. # s"),
    "row a picosecond": ("figures = []", "every = 1e-12"),
    "file that cannot be": (QUOTED, SIGNAL % "a\\u0000.csv"),
    "file of a very long name": (QUOTED, SIGNAL % LONG),
    "file without a name": (QUOTED, SIGNAL % ""),
    "file that is missing": (QUOTED, SIGNAL % "b.csv"),
    "mass of 0": ('"prescribed"\nvelocity =', '"slider"\nmass = 0.0\nforce ='),
    "expression that ends early": ("sin(t)", "sin(t"),
    "unknown name": ("sin(t)", "sin(x)"),
    "name that is an emoji elsewhere": (SIN, ":warning:"),
    "product without a sign": (SIN, "0.1 sin(2 pi t)"),
    "function of a module": (SIN, "0.1*math.sin(t)"),
    "letter for pi": (SIN, "0.1*sin(\u03c0*t)"),
    "case without a comparison": (SIN, "if(t, 0, 0.1)"),
    "case without an alternative": (SIN, "if(t < 1, 0.1)"),
    "program": (QUOTED, """'__import__("os").mkdir("pwned")'"""),
    "one corner": (QUOTED, "[[0.0, 0.1]]"),
    "no corner": (QUOTED, "[]"),
    "ramps that go back in time": (QUOTED, "[[0.0, 0.0], [2.0, 1.0], [1.0, 1.0]]"),
    "very long expression": (SIN, "t + " * 50_000 + "x"),
    "deep expression": (SIN, "(" * 5000 + "t" + ")" * 5000),
}
group("value of a scenario", edited, rows)
rows = {
    "step under the clock": (END, f"{END}\nmax_step = 1e-18"),
    "no step for a method without error estimate": (END, f'{END}\nmethod = "rk4"'),
    "events per step without a step": (END, f'{END}\nevents = "step"'),
    "too few initial z": ("[output]", "[initial]\nz = [0.0]\n[output]"),
    "unknown initial state": ("[output]", '[initial]\nstates = ["stick", "slide"]\n[output]'),
    "initial velocity of a prescribed motion": ("[output]", "[initial]\nv = 0.1\n[output]"),
}
group("run of a scenario", edited, rows)
rows = {
    "table for a text": ('title = "open loop"', "title = {}"),
    "no number in a list": ("[100.0, 50.0]", "[]"),
    "true for a list": ("[100.0, 50.0]", "true"),
    "fraction of a count": (END, f"{END}\nmax_steps = 1.5"),
    "text for a tolerance": (END, f'{END}\natol = "small"'),
    "text in a table of tolerances": (END, f'{END}\natol = {{ z = "small" }}'),
    "empty run": (f"{END}\n", ""),
    "rig by its class": ('kind = "prescribed"', 'kind = "PulledSlider"'),
    "one C for two elements": (ONE_C, "C = [0.1]"),
    "tolerance of what is not there": (END, f"{END}\natol.y = 1"),
    "invariant of an unknown name": (END, f'{END}\nmonitors = ["passivity", "zz < 1"]'),
}
group("key of a scenario", edited, rows)
rows = {
    "end before the start": (END, "t_end = -1.0"),
    "end at the start": (END, "t_end = 0"),
    "end too far": (f"{END}\n\n[output]\n", "t_end = 1e300\n[output]\nevery = 0.1\n"),
    "rows that are counted": (f"{END}\n\n[output]\n", f"{END}\n[output]\nevery = 1000\n"),
    "stiffness below zero": (RIG, PULLED),
}
group("run of a scenario", edited, rows)
rows = {
    "empty": b"",
    "only a comment": "# later\n",
    "half a table head": OPEN_LOOP.replace("[run]", "[run"),
    "a key twice": OPEN_LOOP + "figures = []\n",
    "binary": bytes(range(256)) * 10,
    "UTF-16": OPEN_LOOP.encode("utf-16"),
    "Latin-1": OPEN_LOOP.replace("[rig]", "# Gerät\n[rig]").encode("latin-1"),
    "brackets without end": "a = " + "[" * 5000,
    "a line of 2 MB": "title = '" + "a" * 2_000_000 + "'\n",
    "no number at all": "title = 1.2.3",
    "a text that ends before a point": "title = '.5' x",
    "a bare key without end": "\n" + "a." * 300_000 + "a = 1\n",
    "a quoted key without end": "\n" + '"a".' * 200_000 + "a = 1\n",
    "a head without end": "\n[" + "a." * 300_000 + "a]\n",
    "an inline key without end": "\nk = { " + "a." * 300_000 + "a = 1 }\n",
}
group("file that is no scenario", scenario, rows)
rows = {
    "unit": (END, "t_end = 60 s"),
    "unit that is a quotient": ("v_c = 1e-6", "v_c = 1e-3 mm/s"),
    "power of ten": ("v_c = 1e-6", "v_c = 10^-6"),
    "decimal comma": (END, "t_end = 1,5"),
    "comma of thousands": (END, "t_end = 1,000"),
    "decimal commas before zeros": (ONE_C, "C = [0,05, 0,05]"),
    "list without brackets": ("[100.0, 50.0]", "100.0, 50.0"),
    "list without commas": ("[100.0, 50.0]", "[100.0 50.0]"),
    "list with semicolons": ("[100.0, 50.0]", "[100.0; 50.0]"),
    "colon": (END, "t_end: 1.0"),
    "semicolon": (END, "t_end = 1.0;"),
    "comment of another language": (END, "t_end = 1.0 // s"),
    "comment of Matlab": ("[100.0, 50.0]", "[100.0, 50.0]  % N/m"),
    "head of the second table left out": ("[rig]\n", ""),
    "word without quotes": ('"signed"', "signed"),
    "formula without quotes": (QUOTED, SIN),
    "truth of Python": ("[output]", "[output]\ncsv = True"),
    "nothing of Python": (END, f"{END}\nstep = None"),
    "one quote": ('"open loop"', '"open loop'),
    "words behind a text": ('"open loop"', '"open loop" of mine'),
    "quotes of a typesetter": ('"open loop"', "“open loop”"),
    "path of Windows in double quotes": (QUOTED, SIGNAL % "C:\\Users\\me\\x.csv"),
    "braces over two lines": ("stribeck = {", "stribeck = {\n"),
    "table twice": ("[run]", "[rig]\n[run]"),
    "braces without a comma": ("F_c = 1.0, F_s", "F_c = 1.0 F_s"),
}
group("line that is no TOML", edited, rows)
rows = {
    "of another table": (OPEN_LOOP, "law=signed"),
    "typo": (OPEN_LOOP, "tend=3"),
    "in the wrong table": (OPEN_LOOP, "model.velocity=1"),
    "typo in the right table": (OPEN_LOOP, "run.tend=3"),
    "of a table that is absent": (OPEN_LOOP, "smoothing=3"),
    "very long key": (OPEN_LOOP, f"model.{LONG}.a=1"),
    "rows too close together": (OPEN_LOOP, "output.every=5e-324"),
    "digit before the point": (OPEN_LOOP, "model.k=[.25, 1]"),
    "digit behind the point": (OPEN_LOOP, "run.t_end=3."),
    "no assignment": (OPEN_LOOP, LONG),
    "deep key": (OPEN_LOOP, "title={" + "a." * 50_000 + "a=1}"),
    "unknown key": (OPEN_LOOP, "model.lwa=published"),
    "unknown table": (OPEN_LOOP, "modell.law=published"),
    "unknown law": (OPEN_LOOP, "model.law=singed"),
    "word for a number": (OPEN_LOOP, "run.t_end=soon"),
    "decimal comma": (OPEN_LOOP, "run.t_end=1,5"),
    "thousands": (OPEN_LOOP, "run.t_end=1,000"),
    "nothing for a number": (OPEN_LOOP, "run.t_end="),
    "half a list": (OPEN_LOOP, "model.k=[1.0"),
    "three elements": (OPEN_LOOP, "model.k=[1.0, 2.0, 3.0]"),
    "half a table": (OPEN_LOOP, "record.file=own.csv"),
    "monitor that is a number": (OPEN_LOOP, "run.monitors=[3]"),
    "monitor without a list": (OPEN_LOOP, "run.monitors=coverage"),
    "monitor that is none": (OPEN_LOOP, "run.monitors=['pasivity']"),
    "no key": (OPEN_LOOP, "=3"),
    "no table": (OPEN_LOOP, ".t_end=3"),
    "two points": (OPEN_LOOP, "run..t_end=3"),
    "key of a number": (OPEN_LOOP, "run.t_end.x=3"),
    "two lines": (OPEN_LOOP, "run.t_end=2\nrun.rtol = 1e-3"),
    "endless list": (OPEN_LOOP, "model.k=" + "[" * 5000),
    "key with very many points": (OPEN_LOOP, "a." * 5000 + "a=1"),
}
group("override", scenario, rows)


def system_of(text: str) -> None:
    """Read the system of a scenario file with these contents."""
    Path("a.toml").write_text(text)
    load_system("a.toml")


rows = {"model on a rig": (OPEN_LOOP,)}
group("system of a scenario", system_of, rows)


def grid(*over: str) -> None:
    """Sweep the open loop over these."""
    Path("a.toml").write_text(OPEN_LOOP)
    verb("sweep", "a.toml", "-o", "out", *(part for each in over for part in ("--over", each)))


rows = {
    "no numbers": "F_s",
    "no count": "F_s=1:2",
    "no name": "=1:2:3",
    "unknown spacing": "F_s=1:2:3,lin",
    "word": "F_s=a:2:3",
    "decimal comma": "F_s=0,5:2:4,log",
    "unit": "F_s=1 mN:5 mN:5",
    "fraction of a run": "F_s=1:2:3.5",
    "infinity": "F_s=1:inf:3",
    "one run": "F_s=1:2:1",
    "logarithm of zero": "F_s=0:2:3,log",
    "unknown name": "F_q=1:2:3",
    "name twice": ("F_s=1:2:3", "F_s=1:2:3"),
    "too many runs": ("F_s=1:2:2000", "v_s=1:2:2000"),
}
group("grid of a sweep", grid, rows)


def lively(*vary: str) -> None:
    """Write a live page of the pulled mass with these sliders."""
    verb("play", "pulled_mass", *(each for name in vary for each in ("--vary", name)))


rows = {
    "no number": "F_s=low..high",
    "not a range": "F_s=2",
    "beside the value": "F_s=2..3",
    "highest value first": "F_s=3..0.5",
    "no such number": "F_x=2..3",
    "printed with its value": "delta",
}
group("slider of a live page", lively, rows)


def own(name: str, old: str, new: str, command: str) -> None:
    """Call a verb beside a system and a chart in files of one's own, one of them edited."""
    own_files.write(Path())
    path = Path(f"{name}.toml")
    path.write_text(changed(path.read_text(), old, new))
    verb(*command.split())


def command(text: str) -> None:
    """Call a verb beside a system and a chart in files of one's own."""
    own_files.write(Path())
    verb(*text.split())


STICTION, TO_FORWARD, FIGURES = 'name = "stiction"', 'guard = "F > F_s"', "figures = []"
UNTIL = "t_end = 12.0"
rows = {
    "unknown key": ("pair", "inertia = 0.5", "inertia = 0.5\nmass = 1", "run pair.toml"),
    "initial text": ("pair", "one.x = 1e-3", 'one.x = "1e-3"', "run pair.toml"),
    "key of the run": ("pair", UNTIL, f"{UNTIL}\nrtoll = 1e-8", "run pair.toml"),
    "held outputs of the whole run": (
        "pair",
        UNTIL,
        f'{UNTIL}\nstep = 1e-3\nevents = "held"',
        "run pair.toml",
    ),
    "too many rows": ("pair", FIGURES, f"{FIGURES}\nevery = 1e-9", "run pair.toml"),
    "initial value": ("pair", "one.x = 1e-3", "one.y = 1e-3", "run pair.toml"),
    "one bracket": ("pulled", "[[contact]]", "[contact]", "run pulled.toml"),
    "guard": ("own", TO_FORWARD, 'guard = "F > F_k"', "run pair.toml"),
    "missing chart": ("pulled", '"own.toml"', '"one.toml"', "blocks pulled.toml"),
    "its own chart": ("pulled", '"own.toml"', '"pulled.toml"', "run pulled.toml"),
    "no TOML": ("own", STICTION, "name = stiction", "chart own.toml"),
    "guard of a chart": ("own", TO_FORWARD, 'guard = "F >> F_s"', "check own.toml"),
    "circle of names": (
        "own",
        STICTION,
        f'{STICTION}\nlet = {{ a = "b", b = "a" }}',
        "chart own.toml",
    ),
}
group("own file", own, rows)
rows = {
    "chart file that is missing": "chart none.toml",
    "run of a chart file": "run own.toml",
    "sweep of a chart file": "sweep own.toml --over F_s=1:2:2",
    "missing body": "run pair.toml --set body.tow.inertia=1",
    "unknown name in an override": "run pair.toml --set body.two.inertia=q",
    "no inertia": "run pair.toml --set body.two.inertia=0",
    "value for a contact": "run pair.toml --set contact.gear=1",
    "scenario that is missing": "run gone.toml",
    "scenario that is a folder": "run .",
    "name of no scenario": "debug pulledmass",
    "file without its ending": "run pair",
    "fit of a table": "fit own.csv",
    "fit of a scenario of the package": "fit pulled_mass",
    "chart that is missing": "chart none",
    "chart that is a folder": "chart .",
    "chart file with a law": "chart own.toml --law signed",
    "contact that is missing": "check pair.toml --contact pad",
    "law that is missing": "code --law foo",
    "lesson by another number": "lesson 99",
    "page of no lesson": "lesson --page",
    "chart file with a contact": "chart own.toml --contact pad",
    "chart with a contact": "chart lugre --contact pad",
    "chart without a contact": "chart pair.toml",
    "blocks of no file": "blocks own",
    "ending of a chart": "chart lugre -o x.tex",
    "force of the paper": "paper --force sin( -o p",
    "output folder in a file": "run pulled.toml -o own.toml/out",
    "output folder that is a file": "run pulled.toml -o own.toml",
    "law of a chart with several": "chart gms",
    "ending of a picture": "chart gms --law signed -o c.jpg",
    "no elements": "chart gms --law signed --elements 0",
    "elements below zero": "blocks --elements -1",
    "schematic of no system": "blocks --schematic",
    "ending of a schematic": "blocks pair.toml --schematic -o s.dot",
    "elements of a system": "blocks pair.toml --elements 3",
    "blocks of a chart file": "blocks own.toml",
    "check of a missing chart": "check nothing",
    "chart in other letters": "chart GMS",
    "chart with a hyphen": "handout lu-gre",
    "beginning of a model": "phenomena --model GMS -o o",
    "number of the rig in a sweep": "sweep pulled.toml --over rig.m=1:2:2",
    "law of a broken chart": "check broken:arms --law signed",
    "domain that is empty": "check gms --law signed --domain s>0 --domain s<0",
    "domain that is not encoded": "check gms --law signed --domain exp(s)>1",
    "code of a chart without a rig": "code own.toml",
    "rig of a system": "code pair.toml --rig slider",
    "sweep over a missing contact": "sweep pair.toml --over pad3.F_s=1:2:2",
    "unknown model of the bench": "phenomena --model lugree -o o",
    "unknown phenomenon": "phenomena --phenomenon lagg -o o",
    "number without a value": "phenomena --set F_s -o o",
    "unknown number of the bench": "phenomena --set F_x=1 -o o",
    "chart without values": "phenomena own.toml -o o",
    "system of several contacts": "phenomena pair.toml -o o",
    "model that is no file": "phenomena lugre -o o",
    "data set that is missing": "benchmark --only skates -o out",
    "export without a format": "export own.toml",
    "handout of a chart file": "handout own.toml",
    "debug of a missing scenario": "debug none.toml",
    "run of a trace": "run t.npz",
    "number that there is not": "run pair.toml --set numbers.k=3",
    "debug of a program": "debug mine.py",
    "debug of a trace": "debug t.CSV",
    "override without a value": "run pair.toml --set run.t_end",
    "fit of a missing scenario": "fit none.toml",
    "debug of a run that cannot be": "debug pulled.toml --set run.t_end=-1",
    "domain of an unknown name": "check gms --law signed --domain s>q",
    "velocity of the paper": "paper --velocity __import__('os') -o p",
    "plot of a missing trace": "plot none.npz",
    "plot of no trace": "plot own.toml",
    "replay of a scenario": "replay pulled.toml",
    "replay of a scenario of the package": "replay servo",
    "diff of a chart and a trace": "diff own.toml none.npz",
    "diff of a chart with laws": "diff gms lugre",
    "diff of an unknown law": "diff gms:sigend lugre",
    "diff of a contact of a chart": "diff lugre dahl --contact pad",
    "diff with a missing trace": "diff none.npz none.npz",
    "data that are missing": "benchmark --data nowhere -o out",
}
group("command", command, rows)


# --------------------------------------------------------------------------- records
GOOD = sine_table()
LINES = GOOD.splitlines()
EVEN = np.arange(60) * 0.01


def measured(content: str | bytes) -> None:
    """Run over a table with these contents."""
    Path("own.csv").write_bytes(content.encode() if isinstance(content, str) else content)
    scenario(MEASURED)


def row(number: int, text: str) -> str:
    """Return the good table with one row replaced; the header is row 1."""
    return "\n".join([*LINES[: number - 1], text, *LINES[number:]]) + "\n"


rows = {
    "text in a number column": row(5, "0.03,abc,1"),
    "empty cell": row(5, "0.03,,1"),
    "hexadecimal number": row(5, "0x3,1,1"),
    "very long cell": row(5, f"0.03,{LONG},1"),
    "NaN in the position": row(5, "0.03,nan,1"),
    "infinity": row(60, "0.58,-inf,1"),
    "number too big": row(5, "0.03,1e400,1"),
    "many NaN": "\n".join([LINES[0], *(f"{i},nan,1" for i in range(20))]),
    "row that is too short": row(5, "0.03,1"),
    "row that is too long": row(5, "0.03,1,2,3"),
    "empty row": row(5, ""),
    "empty row between two tables": GOOD + "\n\n1,1,1\n",
    "decimal commas": GOOD.replace(",", ";").replace(".", ","),
    "decimal commas between commas": GOOD.replace(".", ","),
    "remark below": GOOD + "the end\n",
    "quote that never closes": row(5, '"0.03,1,1'),
    "quote that never closes, and a long file": row(5, '"0.03,1,1') + "0,0,0\n" * 50_000,
    "time that goes backward": row(10, "0.01,1,1"),
    "time that falls all along": table(["t", "x", "F"], -EVEN, EVEN, EVEN),
    "missing column": "t,pos,F\n0,0,0\n1,1,1\n",
    "very long head": GOOD.replace("F", LONG, 1),
    "columns divided by /": GOOD.replace(",", "/"),
    "column twice": "t,x,F,x\n0,0,0,0\n1,1,1,1\n",
    "no head line": GOOD.partition("\n")[2],
    "units that contradict the scenario": row(2, "[ms],[mm],[N]"),
    "words in the second line": row(2, "a,b,c"),
    "empty file": "",
    "head line only": "t,x,F\n",
    "four rows": "t,x,F\n0,0,0\n1,1,1\n2,2,2\n3,3,3\n",
    "line of 2 MB": "t,x,F\n0,0," + "1" * 2_000_000 + "\n",
    "binary": bytes(range(256)) * 50,
    "zero byte in a row": row(5, "0.03,\0,1"),
    "UTF-16 without a mark": GOOD.encode("utf-16-le"),
    "UTF-16 cut short": GOOD.encode("utf-16")[:-1],
    "Latin-1": GOOD.replace("F", "µ", 1).encode("latin-1"),
}
group("table", measured, rows)


def setting(old: str, new: str) -> None:
    """Run over a good table by an edited scenario in an inner folder; the table is outside, too."""
    Path("own.csv").write_text(GOOD)
    Path("in").mkdir()
    os.chdir("in")
    Path("own.csv").write_text(GOOD)
    scenario(changed(MEASURED, old, new))


FILE = 'file = "own.csv"'
rows = {
    "unknown unit": ('"mm"', '"furlong"'),
    "unit of something else": ('"mm"', '"ms"'),
    "very long unit": ('unit = "N"', f'unit = "{LONG}"'),
    "no unit": (', unit = "mm"', ""),
    "typo": ('"N" }', '"N", sgin = -1 }'),
    "sign of 2": ('"N" }', '"N", sign = 2 }'),
    "unknown quantity": ("force =", "friction ="),
    "no time": (f"{COLUMN}\n", ""),
    "negative smoothing": (FILE, f"{FILE}\nsmoothing = -1.0"),
    "two delimiters": (FILE, f'{FILE}\ndelimiter = ";;"'),
    "line end as delimiter": (FILE, f'{FILE}\ndelimiter = "\\n"'),
    "another folder": ('"own.csv"', '"../own.csv"'),
    "absolute path": ('"own.csv"', '"/etc/passwd"'),
    "no such file": ('"own.csv"', '"gone.csv"'),
    "start before the record": ("[output]", "[run]\nt_start = -1.0\n[output]"),
    "start after the record": ("[output]", "[run]\nt_start = 0.7\n[output]"),
    "no motion": ('position = { column = "x", unit = "mm" }\n', ""),
    "smoothing beyond all bounds": (FILE, f"{FILE}\nsmoothing = 1e100"),
    "selection by an unknown name": (FILE, f'{FILE}\nwhere = "F > 1 N"'),
    "selection that ends early": (FILE, f'{FILE}\nwhere = "force >"'),
    "selection that is no comparison": (FILE, f'{FILE}\nwhere = "force"'),
    "program as selection": (FILE, f"""{FILE}\nwhere = '__import__("os").mkdir("x") > 0'"""),
    "selection by a number of many digits": (FILE, f'{FILE}\nwhere = "{"1" * 500_000}"'),
    "another column": ('column = "x"', 'column = "pos"'),
    "very long column": ('column = "x"', f'column = "{LONG}"'),
    "column that looks like markup": ('column = "x"', 'column = "[bold]x:warning:"'),
    "wrong delimiter": (FILE, f'{FILE}\ndelimiter = ";"'),
    "selection that nothing fulfils": (FILE, f'{FILE}\nwhere = "force > 100 N"'),
    "selection of one row": (FILE, f'{FILE}\nwhere = "force > 0.9999 N"'),
    "selection by a column that is not given": (FILE, f'{FILE}\nwhere = "normal > 4.5 N"'),
    "selection that divides by zero": (FILE, f'{FILE}\nwhere = "1 / (time - 0.1) > 0"'),
    "selection that cannot be computed": (FILE, f'{FILE}\nwhere = "sqrt(force) > 1 N"'),
    "selection by a unit": (FILE, f'{FILE}\nwhere = "force > 1 lb"'),
    "selection by another unit": (FILE, f'{FILE}\nwhere = "force > -5 mm"'),
}
group("setting of a record", setting, rows)


INSTRUMENT = "t_s;x_mm;F_N\n" + "".join(f"{i / 4};{i};{i / 2}\n" for i in range(20))
COMMAS = INSTRUMENT.replace(".", ",")


def read(content: str | bytes, **options: Any) -> None:
    """Read a table with these contents."""
    Path("own.csv").write_bytes(content.encode() if isinstance(content, str) else content)
    Record.from_csv("own.csv", **options)


def from_csv(content: str | bytes = INSTRUMENT, **options: Any) -> dict[str, Any]:
    return {"content": content, **options}


rows = {
    "another column": from_csv(force=("Kraft", "N")),
    "decimal commas without the option": from_csv(COMMAS),
    "option without decimal commas": from_csv(decimal=","),
    "both marks": from_csv(COMMAS.replace("0,0;", "1.234,5;", 1), decimal=","),
    "another encoding": from_csv(INSTRUMENT.replace("F_N", "F_µN").encode("latin-1")),
    "another encoding far down": from_csv((INSTRUMENT + "9;9;é").encode("latin-1")),
    "wrong encoding": from_csv(INSTRUMENT[:-1], encoding="utf-16"),
    "not of the encoding": from_csv(b"\x81" + INSTRUMENT.encode(), encoding="cp1252"),
    "NaN": from_csv(INSTRUMENT.replace(";4;2.0", ";4;nan")),
    "underscore in a number": from_csv(INSTRUMENT.replace(";4;2.0", ";4;2_0")),
    "no row where it is asked, and words": from_csv(
        INSTRUMENT.replace(";4;2.0", ";4;off"), where="time > 1e3 s"
    ),
    "letter of a quantity": from_csv(where="t > 4 s"),
    "name without its unit": from_csv(INSTRUMENT.replace("F_N", "F [N]")),
    "no names": from_csv(INSTRUMENT.partition("\n")[2]),
    "no names, and decimal commas": from_csv(COMMAS.partition("\n")[2], decimal=","),
    "spreadsheet": from_csv(b"PK\x03\x04" + bytes(range(256))),
    "unit beside a number": from_csv(INSTRUMENT.replace("0.0;0;0.0", "s;0;0.0", 1)),
}
group("Record.from_csv", lambda given: read(**given), rows)


def with_at_most(rows: int) -> None:
    """Read a table while files may have this many rows."""
    with mock.patch.object(_table, "LONGEST_FILE", rows):
        read(INSTRUMENT)


group("long table", with_at_most, {"ten rows": 10})
rows = {
    "encoding that is none": from_csv(encoding="klingon"),
    "encoding of bytes": from_csv(encoding="base64"),
    **{
        f"{quantity} is {given!r}": from_csv(**{quantity: given})
        for quantity, given in {
            "time": 5,
            "position": (),
            "velocity": ("x_mm",),
            "force": ("x_mm", 3),
            "normal": ("x_mm", "mm", 2),
        }.items()
    },
    **{
        f"{option} is {given!r}": from_csv(**{option: given})
        for option, wrong in {
            "where": (None, 0),
            "missing": ("", None, True),
            "delimiter": ("ab", 0),
            "decimal": ("", 1.5),
            "comment": (None, "", [None]),
            "header": (-1, True, NAN),
            "encoding": ("", []),
            "thousands": (".", "ab"),
            "columns": ("t,x,F", [1, 2, 3]),
            "name": (0, {}),
        }.items()
        for given in wrong
    },
    "unit in the name alone": from_csv(position="x_mm"),
    "unit of something else": from_csv(force=("F_N", "mm")),
    "unit against the name": from_csv(time=("t [ms]", "s")),
}
group("Record.from_csv", lambda given: read(**given), rows)
rows = {
    "none": None,
    "number": 5,
    "empty": "",
    "missing": "gone.csv",
    "zero byte": "a\0b",
    "very long": "x" * 300,
    "folder": ".",
}
group("path of a record", Record.from_csv, rows)


def moving(scale: float) -> None:
    """Make a motion of a record of a sine this large."""
    Record.from_arrays(time=EVEN, position=scale * np.sin(EVEN)).motion()


rows = {"too large": 1.7e308}
group("motion", moving, rows)


def fit_command(override: str, head: str = "") -> None:
    """Fit the good table, without the head of one of its tables."""
    Path("own.csv").write_text(GOOD)
    text = f'{MEASURED}\n[fit]\nfree = ["k"]\nsearch = "local"\n'
    Path("a.toml").write_text(text.replace(head, ""))
    verb("fit", "a.toml", "-o", "out", "--set", override)


rows = {
    "wrong name": "fit.free=['kk']",
    "near key": "fit.fre=['k']",
    "nothing free": "fit.free=[]",
    "times reversed": "fit.train=[2.0, 1.0]",
    "bounds reversed": "fit.bounds.k=[2.0, 1.0]",
    "three bounds": "fit.bounds.k=[1.0, 2.0, 3.0]",
    "bounds and not free": "fit.bounds.C=[1.0, 2.0]",
    "search": "fit.search=genetic",
    "rows in a text": "fit.train=4-16",
    "rows with dots": "fit.train=4..16",
    "one time": "fit.train=4",
    "one time in a list": "fit.test=[4.0]",
    "one bound": "fit.bounds.k=1e3",
    "no head of the fit": ("run.rtol=1e-5", "[fit]\n"),
    "no head of the record": ("run.rtol=1e-5", "[record]\n"),
    "names in a text": "fit.free=k, C",
    "text for a column": "record.time=t",
    "measured": "fit.measured=G",
    "no rows": "fit.train=[50.0, 60.0]",
    "column": "record.force.column=f",
}
group("table of a fit", fit_command, rows)


# --------------------------------------------------------------------------- fits
T = np.linspace(0.0, 4.0, 201)
X = 2e-4 * np.sin(2.0 * T)
F = np.sign(np.cos(2.0 * T)) + 1e3 * X
STRIBECK = Stribeck(1.0, 1.5, 1e-3)


@cache
def fitted() -> GMS:
    k = np.array([1e4, 1e4])
    parameters = GMSParameters(
        k, [0.0, 0.0], [1e-3, 1e-3], sigma_2=0.0, stribeck=STRIBECK, v_c=1e-6, weights=0.5 / k
    )
    return GMS(parameters, law="signed")


def arrays(**given: Any) -> Record:
    """Return a record of a sine."""
    columns = {"time": T, "position": X, "force": F, "name": "rig"}
    return Record.from_arrays(**(columns | given))  # type: ignore[arg-type]


rows = {
    "no motion": {"position": None},
    "shorter array": {"force": F[:-1]},
    "two dimensions": {"position": np.ones((40, 2))},
    "one number": {"force": 1.0},
    "no time": {"time": None},
    "words": {"force": ["a"] * 201},
    "dates": {"time": np.arange(201).astype("M8[s]")},
    "complex numbers": {"force": F + 0j},
    "lists of different lengths": {"force": [[1], [1, 2]]},
    "NaN": {"force": np.where(T == 2.0, NAN, F)},
    "infinity": {"position": np.where(T == 2.0, INF, X)},
    "time back": {"time": T[::-1]},
    "time twice": {"time": np.where(T == 2.0, T[101], T)},
    "four rows": {"time": T[:4], "position": X[:4], "force": F[:4]},
    "no rows": {"time": [], "position": [], "force": []},
    "wrong option": {"missing": "fill"},
    "name that is no text": {"name": 5},
    "inputs that are no mapping": {"inputs": T},
    "input of a quantity": {"inputs": {"force": T}},
    "input of the model": {"inputs": {"v": T}},
    "sort": {"sort": "time"},
    "duplicates": {"duplicates": "first"},
}
group("Record.from_arrays", lambda given: arrays(**given), rows)
rows = {
    "empty": (3.0, 3.0),
    "reversed": (3.0, 2.0),
    "behind the end": (20.0, None),
    "too short": (None, 0.05),
}
part = arrays().between
group("part of a record", part, rows)
rows = {"not a number": (NAN, None), "word": ("a", None)}
group("part of a record", part, rows)


DRIVEN = System(
    "driven",
    bodies=(Body("one", inertia=1.0, force="k * (u - x)"),),
    contacts=(Contact("pad", fitted()),),
    signals={"u": 0.0},
    numbers={"k": 1e4},
)


def fitting(given: dict[str, Any]) -> None:
    """Fit with other arguments."""
    fit(**({"records": arrays(), "model": fitted(), "free": ["k"]} | given))


rows = {
    "typo": {"free": ["kk"]},
    "twice": {"free": ["k", "k2"]},
    "nothing": {"free": []},
    "parameter without influence": {"records": arrays(position=X / 200), "free": ["v_s"]},
    "tied and not free": {"tied": ["C"]},
    "fixed and free": {"fixed": {"k": 2.0}},
    "unknown fixed": {"fixed": {"q": 2.0}},
    "fixed against the rule": {"fixed": {"v_c": -1.0}},
    "bounds and not free": {"bounds": {"C": (0, 1)}},
    "bounds reversed": {"bounds": {"k": (2, 1)}},
    "bound": {"bounds": {"k": 3}},
    "bounds against the rule": {"bounds": {"k": (-2, -1)}},
    "nuisance": {"nuisance": ["bias"]},
    "search": {"search": "anneal"},
    "weight": {"weight": "all"},
    "begin": {"begin": "warm"},
    "measured": {"measured": "x"},
    "drive": {"drive": "v"},
    "interval reversed": {"train": (3, 1)},
    "linear": {"linear": ["q"]},
    "cycles": {"cycles": -1.0},
    "model": {"model": 3},
    "no records": {"records": []},
    "no record": {"records": [3]},
    "inertia in a position": {
        "model": DRIVEN,
        "measured": "one.x",
        "free": ["pad.k"],
        "nuisance": ["inertia"],
    },
}
group("fit", fitting, rows)
rows = {
    "interval outside": {"train": (30, 40)},
    "no force": {"records": arrays(force=None)},
    "constant force": {"records": arrays(force=np.full(201, 2.5))},
    "no motion": {"records": arrays(position=0.0 * T)},
    "ten rows": {"records": arrays(time=T[:10], position=X[:10], force=F[:10])},
}
group("record to fit", fitting, rows)


def choosing(given: dict[str, Any]) -> None:
    """Choose with other arguments."""
    one = {"one": (fitted(), ["k"])}
    choose(**({"records": arrays(), "candidates": one} | given))


rows = {
    "unknown fold": {"fold": "rows"},
    "negative cycles": {"cycles": -1.0},
    "no candidates": {"candidates": []},
    "number of candidates": {"candidates": 3},
    "short candidate": {"candidates": [("a", 3)]},
    "name twice": {"candidates": [("a", fitted(), ["k"])] * 2},
    "candidate by name that is a number": {"candidates": {"one": 1}},
    "model of a candidate": {"candidates": {"one": (5, ["k"])}},
    "interval reversed": {"train": (3.0, 1.0)},
    "seed": {"seed": 0.5},
    "no records": {"records": []},
    "name for a record": {"records": "rig"},
    "one record for a fold of records": {"fold": "record"},
    "one amplitude": {"fold": "amplitude"},
    "candidates that cannot be run": {"cycles": 2.0, "most_steps": 1},
}
group("choose", choosing, rows)
rows = {
    "too few cycles": {"cycles": 8.0},
    "too few cycles for our candidates": {"cycles": 8.0, "candidates": None},
    "interval outside": {"train": (50.0, 60.0)},
    "no force": {"records": arrays(force=None)},
    "motion that does not repeat": {"records": arrays(position=T)},
}
group("record to choose by", choosing, rows)


def banking(given: dict[str, Any]) -> None:
    """Make the initial bank with other arguments."""
    initial_bank(**({"records": arrays(), "n": 2} | given))


rows = {
    **{f"n is {n!r}": {"n": n} for n in (0, 2.5, True, None, "4", 61)},
    "train is 'all'": {"train": "all"},
    **{f"records is {each!r}": {"records": each} for each in ([], None)},
    "name for a record": {"records": "rig.csv"},
    "records with none": {"records": [arrays(), None]},
    "smoothing": {"smoothing": -1.0},
}
group("initial_bank", banking, rows)
rows = {
    "no force": {"records": arrays(force=None)},
    "no motion": {"records": arrays(position=np.full(201, 0.2))},
    "constant force": {"records": arrays(force=np.full(201, 3.0))},
    "force of the other sign": {"records": arrays(force=-F)},
    "few rows": {"records": arrays(time=T[:12], position=X[:12], force=F[:12])},
    "one way": {"records": arrays(time=5 * T[:100], position=T[:100], force=T[:100])},
    "interval outside": {"train": (100.0, 200.0)},
}
group("record for an initial bank", banking, rows)


def exciting(given: dict[str, Any]) -> None:
    """Design a motion with other arguments."""
    excite(**({"stroke": 2e-3, "speeds": [1e-3]} | given))


rows = {
    "no stroke": {"stroke": 0.0},
    "infinite stroke": {"stroke": INF},
    "stroke of no float": {"stroke": 1e-200},
    "word": {"stroke": "long"},
    "no speeds": {"speeds": []},
    "speed of zero": {"speeds": [1e-3, 0.0]},
    "endless speed": {"speeds": [1e300]},
    "one speed": {"speeds": 1e-3},
    "rate": {"rate": 0.0},
    "acceleration": {"acceleration": -1.0},
    "motion without end": {"stroke": 1.0, "speeds": [1e-9, 1.0]},
}
group("excite", exciting, rows)


# --------------------------------------------------------------------------- charts
CHART_FILE = """\
name = "stiction"
parameters = ["F_c", "F_s"]

[let]
level = "F_c * sgn(v)"

[[state]]
name = "stuck"
locked = true

[[state]]
name = "slip"
outputs.F = "level"

[[edge]]
name = "release"
from = "stuck"
to = "slip"
guard = "F > F_s"

[[edge]]
name = "arrest"
from = "slip"
to = "stuck"
guard = "v < 0"
do.v = "0"
"""
PLAIN = 'parameters = ["F_c", "F_s"]'
TABLES = '[[parameter]]\nname = "F_c"\n[[parameter]]\nname = "F_s"\nrule = ">= F_x"\n'


def chart_file(old: str, new: str) -> None:
    """Load an edited chart file."""
    Path("own.toml").write_text(CHART_FILE.replace(old, new, 1), encoding="utf-8")
    Chart.load("own.toml")


def chart_bytes(content: bytes) -> None:
    """Load a chart file with these contents."""
    Path("own.toml").write_bytes(content)
    Chart.load("own.toml")


rows = {
    "unknown state": ('to = "stuck"', 'to = "stick"'),
    "action": ('do.v = "0"', 'do.q = "0"'),
    "name used twice": ('"arrest"', '"release"'),
    "no force": ('outputs.F = "level"\n', ""),
    "force of a locked state": ("locked = true", 'locked = true\noutputs.F = "1"'),
    "bad name": ('"slip"\nout', '"is_x"\nout'),
    "rule": (PLAIN, TABLES),
    "loop": ('"level"', '"F"'),
    "place of no state": ('do.v = "0"\n', 'do.v = "0"\n[layout]\nslop = [0, 0]\n'),
    "unknown key": ("guard", "gard"),
    "wrong type": ("locked = true", "locked = 1"),
    "word for true": ("locked = true", 'locked = "yes"'),
    "number for a text": ('outputs.F = "level"', "outputs.F = 1"),
    "output outside outputs": ('outputs.F = "level"', 'F = "level"'),
    "name of another program": ("[[edge]]", "[[transition]]"),
    "single brackets": ("[[edge]]", "[edge]"),
    "missing key": ('to = "slip"\n', ""),
    "unknown table": ("[[state]]", "[[stat]]"),
    "both kinds of parameters": (PLAIN, PLAIN + "\n[[parameter]]\nname = 'k'"),
    "unknown name": ("F > F_s", "F > F_k"),
    "let": ('"F_c * sgn(v)"', '"F_c * (v"'),
}
group("chart file", chart_file, rows)
rows = {
    "empty": b"",
    "no TOML": b"name = ",
    "no text": b"\xff\xfe",
    "endless key": b".".join([b"a"] * 500) + b" = 1",
    "long array": b'name = "a"\nstate = [\n' + b"{},\n" * 4_000 + b"]\nq = 1\n",
    "too large": b"#" * 1_100_000,
    "deep": b"name = " + b"[" * 5000,
    "archive": b"PK\x03\x04\x14\x00",
    "JSON": b'{"state": []}',
    "XML": b'<?xml version="1.0"?><scxml/>',
}
group("file that is no chart", chart_bytes, rows)
rows = {"missing": "none.toml", "folder": ".", "zero byte": "a\0b.toml", "number": 5}
group("path of a chart", Chart.load, rows)


def document(text: str) -> None:
    """Read a chart from a document."""
    Path("own.toml").write_text(text, encoding="utf-8")
    Chart.from_scxml("own.toml")


rows = {
    "type definition": '<!DOCTYPE scxml><scxml xmlns="http://www.w3.org/2005/07/scxml"/>',
    "larger than a chart": " " * 11_000_000,
    "20,000 states": (
        '<scxml xmlns="http://www.w3.org/2005/07/scxml">'
        + "".join(f'<state id="s{i}"><transition target="s0"/></state>' for i in range(20_000))
        + "</scxml>"
    ),
}
group("document", document, rows)
SCXML = '<scxml xmlns="http://www.w3.org/2005/07/scxml">{}</scxml>'


def inside(text: str) -> None:
    """Read a chart with the state a, and what is given inside of it."""
    document(SCXML.format(f'<state id="a">{text}</state>'))


TWICE = '<assign location="n" expr="1"/>' * 2
rows = {
    "parallel states": "<parallel/>",
    "message": '<onentry><send event="b" delay="1s"/></onentry>',
    "no end": '<transition event="done.state.a" target="a"/>',
    "any event": '<transition event="*" target="a"/>',
    "two targets": '<transition target="a b"/>',
    "no target, with exit": f"<onexit>{TWICE[:31]}</onexit><transition/>",
    "assigned twice": f"<onentry>{TWICE}</onentry>",
    "data without a value": '<datamodel><data id="n"/></datamodel>',
}
group("state of a document", inside, rows)
rows = {"words": "<datamodel><data id='n' expr='\"red\"'/></datamodel>"}
group("data of a document", inside, rows)
STATE, ASSIGN = '<state id="stick">', '<assign location="z" expr="-Math.abs(z)"/>'
DATA, LATER = '<data id="z" expr="0"/>', '<send event="q" delay="1s"/>'
rows = {
    "no XML": (FOREIGN, "<scxml"),
    "no state": (FOREIGN, '<scxml xmlns="http://www.w3.org/2005/07/scxml"/>'),
    "another root": (FOREIGN, "<html/>"),
    "parallel states": (STATE, f"<parallel></parallel>{STATE}"),
    "script": (STATE, f"<script></script>{STATE}"),
    "history": (STATE, f"{STATE}<history/>"),
    "another machine": (STATE, f"{STATE}<invoke/>"),
    "state without a name": (STATE, "<state/>" + STATE),
    "unknown initial state": ('initial="stick"', 'initial="stuck"'),
    "two initial states": ('initial="stick"', 'initial="stick slip"'),
    "late binding": (
        'initial="stick">',
        'initial="stick" binding="late"><state id="q"><datamodel><data id="i"/>'
        "</datamodel></state>",
    ),
    "state twice": (STATE, '<final id="stick"/>' + STATE),
    "log at the start": (
        STATE,
        f'<state id="a"><initial><transition target="b"><log/></transition></initial>'
        f'<state id="b"/></state>{STATE}',
    ),
    "nine levels": (
        STATE,
        "".join(f'<state id="{c}">' for c in "abcdefghi") + "</state>" * 9 + STATE,
    ),
    "data when it is done": (STATE, '<final id="e"><donedata/></final>' + STATE),
    "data of a file": (DATA, '<data id="z" src="z.json"/>'),
    "data that are a list": (DATA, '<data id="q">[1, 2]</data>'),
    "data that begin as an input": (DATA, '<data id="z" expr="2 * v"/>'),
    "data that are no number": (DATA, '<data id="z" expr="1 / 0"/>'),
    "unknown target": ('target="slip"/>', 'target="nowhere"/>'),
    "no target, with entry": ("</onentry>", '</onentry><transition cond="v &gt; 1"/>'),
    "no target, beside a time": (
        '<transition target="slip"/>',
        '<transition target="slip" cond="after(3)"/><transition cond="z &gt; 1"/>',
    ),
    "timer beside another way out": (
        STATE,
        f'{STATE}<onentry>{LATER}</onentry><transition event="q" target="slip"/>',
    ),
    "timer with a condition": (
        STATE,
        f'{STATE}<onentry>{LATER}</onentry><onexit><cancel sendid="q"/></onexit>'
        '<transition event="q" target="slip" cond="z &gt; 1"/>',
    ),
    "event without a guard": ('cond="!(v &gt;= 1 || z &gt; 9)"', ""),
    "message of an edge": (ASSIGN, '<send event="x"/>'),
    "case": (ASSIGN, "<if cond='1'/>"),
    "element of another language": (ASSIGN, '<run xmlns="urn:mine"/>'),
    "no value assigned": ('expr="-Math.abs(z)"', ""),
    "assigned twice": ("</transition>", '<assign location="z" expr="0"/></transition>'),
    "assigned to no variable": ('location="z" expr="-', 'location="q" expr="-'),
    **{
        f"guard {cond}": ("z &lt; -1", cond)
        for cond in ("In('slip')", "Math.cbrt(z) &gt; 1", "_event.data.z", "v &gt; 'a'")
    },
}
group("document of another tool", foreign, rows)
rows = {
    "guard": ('cond="v &lt; 0.0"', 'cond="v &lt; 1.0"'),
    "no guard": ('cond="v &lt; 0.0" ', ""),
    "action": ('expr="-(F_c', 'expr="(F_c'),
    "entry": ('expr="f / (1', 'expr="f / (2'),
    "order": ('gms:order="1"', 'gms:order="0"'),
}
group("document changed beside its texts", lambda *by: Chart.from_scxml(edited_export(*by)), rows)
rows = {
    "missing": ("none.scxml", {}),
    "number": (5, {}),
    "callbacks": ("none.scxml", {"callbacks": {"look": {}}}),
    "argument": ("none.scxml", {"flow": {}}),
}
group("path of a document", lambda path, texts: Chart.from_scxml(path, **texts), rows)


def machine(kind: Callable[..., Any], second: Any, callbacks: Any, more: Mapping[str, Any]) -> None:
    """Read a chart from a machine with one edge."""
    made = kind(states=["a", second], initial="a", auto_transitions=False)
    made.add_transition("go", "a", "b", **more)
    Chart.from_transitions(made, outputs={"F": "0"}, callbacks=callbacks)


rows = {
    "awaited": (AsyncMachine, "b", {}, {}),
    "parallel": (HierarchicalMachine, {"name": "b", "parallel": ["c", "d"]}, {}, {}),
    "no guard": (Machine, "b", {}, {}),
}
group("machine", machine, rows)
rows = {
    "condition": ({}, {"conditions": "is_hot"}),
    "action": ({}, {"after": "count"}),
    "before the condition": ({"look": {"n": "1"}}, {"prepare": "look"}),
    "no such function": ({"is_hot": "v > 1"}, {}),
    "no table": (3, {}),
    "mapping for a condition": ({"is_hot": {"n": "1"}}, {"conditions": "is_hot"}),
}
group("function of a machine", partial(machine, Machine, "b"), rows)


class Watching:
    """A model whose method transitions calls by its name."""

    def on_enter_slip(self) -> None:
        """Do nothing."""


def featured(feature: type, **state: object) -> Machine:
    """Return a machine with a feature of transitions, and with one state that has more."""
    kind = add_state_features(feature)(type("Featured", (Machine,), {}))
    return kind(states=["a", {"name": "b", **state}], initial="a", auto_transitions=False)


def read_from(made: Callable[[], object], **texts: object) -> Chart:
    """Read a chart from a machine."""
    return Chart.from_transitions(made(), **{**TEXTS, **texts})


def slipping(**more: Any) -> Callable[[], Machine]:
    """Return how a machine is made whose second state has more."""
    return lambda: small(states=["stick", MachineState("slip", **more)])


OF_MACHINES = "before_state_change after_state_change prepare_event finalize_event on_exception"
THREE = [["slips", "stick", "slip"], ["sticks", "slip", "stick"], ["go", "slip", "stick"]]
INSIDE = {"name": "slip", "children": "b", "initial": "c"}
TWO = [["slips", "stick", "slip"], ["sticks", "stick", "stick"]]
rows = {
    "no machine": lambda: "a machine",
    **{
        f"callback {each}": partial(small, **{each: "look"})
        for each in (*OF_MACHINES.split(), "on_final")
    },
    "no initial state": lambda: small(initial=None, model=None),
    **{f"callback on_{each}": slipping(**{f"on_{each}": "look"}) for each in ("enter", "exit")},
    "method of the model": lambda: small(model=Watching()),
    "timeout": lambda: featured(Timeout, timeout=2, on_timeout="x"),
    "volatile state": lambda: featured(Volatile),
    "error state": lambda: featured(Error),
    **{
        f"callback {each} of an edge": partial(one_edge, **{each: "look"})
        for each in ("before", "after", "prepare")
    },
    "no guard of one edge": lambda: small(transitions=THREE),
    "unknown target": lambda: one_edge(dest="nowhere"),
    "unknown source": lambda: one_edge(source="nowhere"),
    "unknown initial state inside": lambda: HierarchicalMachine(
        states=["stick", INSIDE], initial="stick", transitions=TWO
    ),
}
group("machine of another tool", read_from, rows)
rows = {
    "before every condition": {"look": {"n": "1"}},
    "assigned twice": {"one": {"n": "1"}, "two": {"n": "2"}},
}
group(
    "callbacks of a machine",
    lambda given: read_from(
        partial(small, prepare_event="look")
        if "look" in given
        else slipping(on_enter=["one", "two"]),
        callbacks=given,
    ),
    rows,
)
rows = {
    "unknown argument": {"gards": {}},
    "guard of no edge": {"guards": {"slip": "v > 1"}},
    "text for the guards": {"guards": "v > 1"},
    "actions of no edge": {"actions": {"x": {}}},
    "list of actions": {"actions": [1]},
    "flow of no state": {"flows": {"stuck": {}}},
    "number for the entries": {"entry": 3},
    "text for the locked states": {"locked": "stick"},
    "locked state that is none": {"locked": ["stuck"]},
    "text for the parameters": {"parameters": "k"},
    "parameter without a name": {"parameters": [{"unit": "N"}]},
    "number for the variables": {"variables": 5},
    "number for the initial values": {"initial": 5},
    "parameter with an unknown field": {"parameters": [{"name": "k", "size": 1}]},
    "no force": {"outputs": {}},
    "guard that cannot be parsed": {"guards": {"slips": "w > 1", "sticks": "True"}},
}
group("texts beside a machine", lambda texts: read_from(small, **texts), rows)
STICK = State("stick", flow={"z": "v"})
SLIP = State("slip", flow={"z": "C * (sgn(v) - z / s)"})
GO = Transition("go", "stick", "slip", guard="z >= s and v > v_c")
BACK = Transition("back", "slip", "stick", guard="abs(v) <= v_c")
K = ("k", "C", "v_c")


def chart(changes: Mapping[str, Any]) -> Chart:
    """Return a valid chart with changes."""
    sound: dict[str, Any] = {
        "name": "rubber",
        "inputs": ("v", "s"),
        "variables": ("z",),
        "parameters": K,
        "states": (STICK, SLIP),
        "transitions": (GO, BACK),
        "outputs": {"F": "k * z + 0.1 * dz"},
    }
    return Chart(**{**sound, **changes})


def edge(**changes: Any) -> dict[str, Any]:
    """Return the valid chart's edges with the first one changed."""
    return {"transitions": (dataclasses.replace(GO, **changes), BACK)}


def inside(*states: State, **changes: Any) -> dict[str, Any]:
    """Return the valid chart's states with states inside the second one, and further changes."""
    return {**state(states=states or (State("one"), State("two"))), **changes}


def state(**changes: Any) -> dict[str, Any]:
    """Return the valid chart's states with the second one changed."""
    return {"states": (STICK, dataclasses.replace(SLIP, **changes))}


rows = {
    "unknown source": edge(source="glue"),
    "line end in a name": edge(source="gl\nue"),
    "unknown one of two sources": edge(source=("stick", "glue")),
    "unknown state inside another": inside(**edge(target="slip.three")),
    "state inside another by its name alone": inside(**edge(target="two")),
    "age of two levels": inside(**edge(source=("stick", "slip"), guard="after(1)")),
    "flow of no variable": state(flow={"z": "v", "w": "1"}),
    "entry of no variable": state(entry={"w": "1"}),
    "action of no variable": edge(actions={"s": "0"}),
    "no outputs": {"outputs": {}},
    "text for the outputs": {"outputs": "k * z"},
    "unknown output": {"outputs": {"G": "k"}},
    "unknown output of a state": state(outputs={"G": "k"}),
    "force of a locked state": state(locked=True, outputs={"F": "k"}),
    "F in a let": {"let": {"pull": "abs(F)"}},
    "F in a flow": state(flow={"z": "F"}),
    "a in a force": state(outputs={"F": "a"}),
    "layout of no state": {"layout": {"stick": (0, 0), "slop": (9, 0)}},
    "layout without a state": {"layout": {"stick": (0, 0)}},
    "layout without numbers": {"layout": {"stick": (0, 0), "slip": (9, "right")}},
    "layout that is no mapping": {"layout": "right"},
    "start of no variable": {"initial": {"y": 1.0}},
    "start that is no number": {"initial": {"z": "far"}},
    "start that is no mapping": {"initial": 1.0},
    "let of a parameter": {"let": {"u": "k * z"}, "contact_outputs": {"F": "F + u"}},
    "no states": {"states": (), "transitions": ()},
    "outputs by state": {"outputs": {"F": {"stick": "k * z"}}},
    "let and parameter": {"let": {"k": "1"}},
    "force and parameter": {"velocities": ("v", "w"), "parameters": (*K, "F_w")},
    "text for a state": {"states": (STICK, "slip")},
    "none for an edge": {"transitions": (GO, None)},
    "parameter twice": {"parameters": (*K, "k")},
    "variable and parameter": {"parameters": (*K, "z")},
    "derivative and parameter": {"parameters": (*K, "dz")},
    "state twice": {"states": (STICK, STICK)},
    "state inside and parameter": inside(parameters=(*K, "slip__two")),
    "age and parameter": inside(parameters=(*K, "slip__age")),
    "edge of a history and parameter": {
        "states": (STICK, dataclasses.replace(SLIP, states=(State("a"), State("b")), history=True)),
        "parameters": (*K, "go__b"),
    },
    "path for a name": inside(State("one.two")),
    "state and edge": edge(name="slip"),
    "parameter and edge": edge(name="k"),
    "parameter t": {"parameters": (*K, "t")},
    "parameter v": {"inputs": ("s",), "parameters": ("v",)},
    "edge x": edge(name="x"),
    "empty name": {"parameters": (*K, "")},
    "keyword": {"parameters": (*K, "if")},
    "number for a parameter": {"parameters": (*K, 3)},
    "private name": {"parameters": (*K, "_k")},
    "method of an edge": state(name="to_slip"),
    "accent beside its letter": {"parameters": (*K, "e\u0301")},
    "letter of mathematics": edge(name="\U0001d467"),
    "rule of an unknown name": {"parameters": ("k", "C", Parameter("v_c", "m/s", "< v_max"))},
    "parameters as a text": {"parameters": "k C"},
    "a state for states": {"states": STICK},
}
group("chart", chart, rows)
rows = {"states inside without a name": (State("stick"), State("slip"))}
group("state", lambda *inside: State("on", *inside), rows)
rows = {
    "state of a machine in a guard": edge(guard="is_in(pad.stuck) > 0"),
    "count in a guard": edge(guard="count(slip) > 2"),
    "unknown name in a guard": edge(guard="z >= s and u > v_c"),
    "function that is a parameter": {"parameters": (*K, "mod"), **edge(guard="mod(z, 1) > s")},
    "time with a unit": edge(guard="after(2, sec)"),
    "time with a unit after a blank": edge(guard="after(20 ms)"),
    "after without a time": edge(guard="after()"),
    "after of two": edge(guard="z >= s or after(2, s_0)"),
    "after as a number": edge(guard="1 < after(2)"),
    "guard of equality": edge(guard="z == s"),
    "decimal comma in a guard": edge(guard="z >= 0,8 * s"),
    "capitals in a guard": edge(guard="z >= s AND v > v_c"),
    "parenthesis that stays open": edge(guard="abs(z >= s"),
    "flow that is a condition": state(flow={"z": "v > 0"}),
    "two operators": state(entry={"z": "1 +* v"}),
    "two names": edge(actions={"z": "s s"}),
    "unknown name in an output": {"outputs": {"F": "k * zz"}},
    "contact's output": {"contact_outputs": {"F": "F + k * z"}},
    "force in a condition that lasts": edge(guard="duration(F > 1) > 2"),
    "how long a number lasts": edge(guard="duration(z) > 2"),
    "how long two last": edge(guard="duration(v > 0, 1) > 1"),
    "how long, without a comparison": edge(guard="duration(v > 0)"),
    "how long, denied": edge(guard="not duration(v > 0)"),
    "duration that is a parameter": {
        "parameters": (*K, "duration"),
        **edge(guard="duration(v > 0) > 1"),
    },
    "bytes for a flow": state(flow={"z": b"v"}),
    "guard that is a number": edge(guard="z"),
    "derivative in a guard": edge(guard="dz > 0"),
    "empty guard": edge(guard=""),
    "attribute": edge(guard="\u00e9 > z.real"),
    "no guard": edge(guard=None),
}
group("text of a chart", chart, rows)
rows = {
    "state that is unknown": lambda: chart({}).state_index("slide"),
    "edge that is unknown": lambda: chart({}).guard_text("slide"),
    "edge that is none": lambda: chart({}).guard_text(None),
    "edge of none": lambda: chart({"transitions": ()}).guard_text("go"),
}
group("part of a chart", called, rows)


def nest() -> State:
    """Return a state in which states nest deeper than anybody reads."""
    found = State("s")
    for level in range(20):
        found = State(f"s{level}", states=(found,))
    return found


rows = {
    "part that no state has": lambda: State("stick", flow={"z": "v"}, during="z = 0"),
    "edges of composite states without end": lambda: chart(
        inside(*(State(f"s{i}") for i in range(2500)), **edge(source="slip"))
    ),
    "state inside twice": lambda: inside(STICK, STICK),
    "history of nothing": lambda: State("slip", history=True),
    "deep history": lambda: State("slip", states=(STICK,), history="deep"),
    "initial state elsewhere": lambda: State("slip", states=(STICK,), initial="stuck"),
    "text for a state inside": lambda: State("slip", states=("stick",)),  # type: ignore[arg-type]
    "states that nest without end": (nest,),
    "argument of transitions": lambda: call(Transition, trigger="go", source="stick", dest="slip"),
    "second argument of transitions": lambda: call(Transition, "go", "stick", dest="slip"),
    "edge without a guard": lambda: call(Transition, "go", "stick", "slip"),
    "locked by a number": lambda: State("slip", locked=1),
    "edge from nowhere": lambda: Transition("go", (), "slip", guard="v > 0"),
    "name that is none": lambda: Chart(5, states=(), outputs={}),
}
group("part of a chart", called, rows)


def call(kind: Any, *args: object, **given: object) -> object:
    """Make an object with arguments that it does not take."""
    return kind(*args, **given)


rows = {
    "no law": ("GMS", (GMS, GMSParameters.paper("stick-slip")), {}),
    "law without its name": ("GMS", (GMS, GMSParameters.paper("stick-slip"), "signed"), {}),
    "no law of a chart": ("gms_element", (gms_element,), {}),
    "number with another name": ("Stribeck", (Stribeck, 1.0, 1.5), {"vs": 1e-3}),
    "number too few": ("PulledSlider", (PulledSlider, 1.0, 2.0), {}),
    "stiffness of a spring": ("spring 'shaft'", (Spring, "shaft", "motor"), {"stiffness": 2.0}),
    "mass of a body": ("body 'block'", (Body, "block"), {"mass": 2.0}),
    "sample time": ("sampled 'pid'", (Sampled, "pid"), {"sample_time": 1e-3, "updates": {}}),
    "velocity of a supervisor": ("supervisor 'mode'", (Supervisor, "mode", None), {"v": "w"}),
    "shares": ("GMSParameters.from_shares", (GMSParameters.from_shares,), {"shares": [1.0]}),
    "nothing": ("GMSParameters.paper", (GMSParameters.paper,), {}),
    "no end of a system": ("simulate", (simulate, DRIVEN), {}),
    "no rig": ("simulate", (simulate, GMSParameters.paper("stick-slip")), {}),
    "option by its place": ("Trace.trust", (Trace.trust, None, True), {}),
    "arrays by their places": ("Record.from_arrays", (Record.from_arrays, [0, 1], [0, 1]), {}),
}
group(
    "argument",
    lambda args, given: call(*args, **given),
    {name: (args, given) for name, (place, args, given) in rows.items()},
)


# --------------------------------------------------------------------------- parameters
BANK = {"k": (40, 10), "stribeck": STRIBECK, "v_c": 1e-6}
RULED = (
    Parameter("a", "1", ">= 0 and < 2"),
    Parameter("b", "1", "> a"),
    Parameter("c", "m", "< a", meaning="height"),
    Parameter("d", "m", "<=c"),
)


def one_state(
    *parameters: Parameter | str, inputs: tuple[str, ...] = ("v",), F: str = "z"
) -> Chart:
    """Return a chart of one state."""
    return Chart("r", inputs, ("z",), parameters, (State("a_", {"z": inputs[-1]}),), (), {"F": F})


def own_model(values: Any = None, **changes: Any) -> ChartModel:
    """Return a model of the GMS element."""
    values = {"k": 1.0, "sigma": 0.0, "C": 1.0, "v_c": 1e-6, **(values or {})}
    return ChartModel(gms_element("signed"), values, **{"n": 2, "stribeck": STRIBECK, **changes})


def ruled(**changes: Any) -> ChartModel:
    """Return a model whose parameters are bounded by each other."""
    return ChartModel(one_state(*RULED), {"a": 1, "b": 2, "c": 0.5, "d": 0.25, **changes}, n=2)


def bank(**changes: Any) -> GMSParameters:
    """Return parameters of two elements."""
    given = {"sigma": (1, 2), "C": (0.1, 0.2), "sigma_2": 0.4, **BANK, **changes}
    return GMSParameters(**given)


def shares(**changes: Any) -> GMSParameters:
    """Return parameters of two elements that share the friction."""
    return GMSParameters.from_shares(**{"alpha": (0.5, 0.5), "C": 2.0, **BANK, **changes})


def lugre(**changes: Any) -> LuGre:
    """Return a LuGre model."""
    given = {"sigma_0": 1e3, "sigma_1": 31.6, "sigma_2": 4.0, "stribeck": STRIBECK}
    return LuGre(**{**given, **changes})


def curve(**changes: Any) -> Stribeck:
    """Return a curve."""
    return Stribeck(**{"F_c": 1.0, "F_s": 1.5, "v_s": 1e-3, **changes})


def pulled(**changes: Any) -> PulledSlider:
    """Return a rig."""
    return PulledSlider(**{"mass": 1, "stiffness": 1, "speed": 1, **changes})


def pushed(mass: Any) -> Slider:
    """Return a rig."""
    return Slider(mass, "t")


rows = {
    "curve with F_c = 0": (curve, {"F_c": 0}),
    "curve with F_c = NAN": (curve, {"F_c": NAN}),
    "curve with F_s = INF": (curve, {"F_s": INF}),
    "curve with v_s = 0": (curve, {"v_s": 0}),
    "curve with v_s = 1e-310": (curve, {"v_s": 1e-310}),
    "curve with v_s = 'fast'": (curve, {"v_s": "fast"}),
    "curve with v_s = None": (curve, {"v_s": None}),
    "bank with k = (40, 0)": (bank, {"k": (40, 0)}),
    "bank with k = (NAN, 1)": (bank, {"k": (NAN, 1)}),
    "bank with k = ('a', 'b')": (bank, {"k": ("a", "b")}),
    "bank with k = [[1], [1, 2]]": (bank, {"k": [[1], [1, 2]]}),
    "bank with sigma = (1, -2)": (bank, {"sigma": (1, -2)}),
    "bank with C = (0.1, INF)": (bank, {"C": (0.1, INF)}),
    "bank with weights = (1, 0)": (bank, {"weights": (1, 0)}),
    "bank with v_c = 0": (bank, {"v_c": 0}),
    "bank with stribeck = None": (bank, {"stribeck": None}),
    "shares with alpha = (0.5, 0.4)": (shares, {"alpha": (0.5, 0.4)}),
    "shares with alpha = (1.0, 0.0)": (shares, {"alpha": (1.0, 0.0)}),
    "shares with C = -1": (shares, {"C": -1}),
    "shares with C = NAN": (shares, {"C": NAN}),
    "lugre with sigma_0 = 0": (lugre, {"sigma_0": 0}),
    "lugre with stribeck = 3": (lugre, {"stribeck": 3}),
    "own with n = 2.5": (own_model, {"n": 2.5}),
    "own with n = 'two'": (own_model, {"n": "two"}),
    "own with weights = (1, -1)": (own_model, {"weights": (1, -1)}),
    "own with stribeck = None": (own_model, {"stribeck": None}),
    "own with values = {'k': NAN}": (own_model, {"values": {"k": NAN}}),
    "own with values = {'k': '100'}": (own_model, {"values": {"k": "100"}}),
    "own with values = {'k': None}": (own_model, {"values": {"k": None}}),
    "own with values = {'v_c': [1e-6, 1e-6]}": (own_model, {"values": {"v_c": [1e-6, 1e-6]}}),
    "own with values = {'k': [[1], [1, 2]]}": (own_model, {"values": {"k": [[1], [1, 2]]}}),
    "ruled with a = 3": (ruled, {"a": 3}),
    "ruled with a = -1": (ruled, {"a": -1}),
    "pushed with mass = 0": (pushed, {"mass": 0}),
    "pulled with mass = -1": (pulled, {"mass": -1}),
    "pulled with stiffness = 0": (pulled, {"stiffness": 0}),
    "model of a name": (ChartModel, {"chart": "dahl", "values": {}}),
    "GMS without parameters": (GMS, {"parameters": {}, "law": "signed"}),
    "curve with F_s = 0.5": (curve, {"F_s": 0.5}),
    "bank replaced with q = 1": (lambda **new: bank().replaced(**new), {"q": 1.0}),
    "bank replaced with Fs = 1": (lambda **new: bank().replaced(**new), {"Fs": 1.0}),
    "bank with k = []": (bank, {"k": []}),
    "bank with k = None": (bank, {"k": None}),
    "bank with sigma = 1": (bank, {"sigma": 1}),
    "own with values = {'q': 1.0}": (own_model, {"values": {"q": 1.0}}),
    "own with values = {'k': [1, 2, 3]}": (own_model, {"values": {"k": [1, 2, 3]}}),
    "ruled with b = 0.5": (ruled, {"b": 0.5}),
    "ruled with b = [2, 1]": (ruled, {"b": [2, 1]}),
    "ruled with c = 1": (ruled, {"c": 1}),
    "ruled with d = 2": (ruled, {"d": 2}),
    "another column of Table I": (GMSParameters.paper, {"column": "slow"}),
    "input that no model supplies": (
        ChartModel,
        {"chart": one_state(inputs=("v", "u")), "values": {}},
    ),
    "missing values": (ChartModel, {"chart": one_state("q", "r"), "values": {"q": 1}}),
    "length of no parameter k": (
        ChartModel,
        {"chart": one_state("q"), "values": {"q": [1] * 3}, "n": 2},
    ),
}
group("parameter", lambda make, given: make(**given), rows)
rows = {
    "word": ("k", {"rule": "positive"}),
    "bound without a number": ("k", {"rule": "> "}),
    "half a rule": ("k", {"rule": "> 0 and"}),
    "equality": ("k", {"rule": "== 0"}),
    "infinite bound": ("k", {"rule": "> 1e999"}),
    "assumption": ("k", {"rule": "> 0", "assumed": "0 <"}),
    "number": ("k", {"rule": 0}),
    "bound of an unknown name": ("k", {"rule": "> q"}),
    "bound of itself": ("k", {"rule": "> k"}),
}
group("rule of a parameter", lambda name, given: one_state(Parameter(name, **given), "h"), rows)

rows = {"equation that is a table": lambda: chart(state(flow={"z": {"v": 1}}))}
group("wrong kind", called, rows)
PUSHED, SWEPT = Prescribed(0.2), {"v_s": [1e-3, 2e-3]}
rows = {
    "rig before model": ((PUSHED, stick_slip("signed"), 3.0, SWEPT),),
    "values before rig": ((stick_slip("signed"), SWEPT, PUSHED, 3.0),),
    "values for the end": ((stick_slip("signed"), PUSHED, SWEPT, 3.0),),
    "values without a name": ((stick_slip("signed"), PUSHED, 3.0, [1.0]),),
}
group("sweep", lambda given: sweep(*given, engine="machines"), rows)


# --------------------------------------------------------------------------- monitors
def monitored(monitors: Callable[[], Any]) -> None:
    """Run with these monitors."""
    simulate(stick_slip("signed"), Prescribed(0.2), 1.0, monitors=monitors())


rows = {
    "typo": lambda: "pasivity",
    "twice": lambda: ["chattering", Chattering(5)],
    "condition twice": lambda: ["z <= s", "z <= s"],
    "number": lambda: [3],
    "contact of a model": lambda: "pad: passivity",
    "name alone": lambda: "z",
    "one time": lambda: Chattering(times=1),
    "fraction of a time": lambda: Chattering(times=2.5),
    "no time": lambda: Chattering(within=0.0),
    "tolerance": lambda: Passivity(tolerance=-1.0),
    "unknown name": lambda: "z <= q",
    "half a text": lambda: "abs(z) <= 1.1*",
    "unknown element": lambda: "state(9) == slip",
    "unknown state": lambda: "state == slide",
    "equality": lambda: "z == s",
}
group("monitors", monitored, rows)
rows = {f"unit {text!r}": lambda text=text: text for text in ("z < 3 mm/s", "F < 2 furlong")}
group("monitors", monitored, rows)


# --------------------------------------------------------------------------- branches
def forked(given: dict[str, Any]) -> None:
    Session(stick_slip("signed"), Prescribed("0.1*t"), 1.0).fork(**given)


rows = {
    "values in a list": {"values": []},
    "a number for a law": {"law": 7},
    "a number for a name": {"name": 7},
}
group("fork", forked, rows)
# --------------------------------------------------------------------------- runs
GIVEN = stick_slip("signed")


def running(given: dict[str, Any]) -> None:
    """Simulate for a second with these arguments."""
    simulate(GIVEN, Prescribed("0.2"), **{"t_end": 1.0, **given})


wrong: dict[str, tuple[Any, ...]] = {
    "t_end": (NAN, INF, "long", None),
    "t_start": ("now",),
    "method": ("rk5", 5, None, dict),
    "step": (0.0, -0.1, NAN, "big"),
    "rtol": (0.0, -1e-6, "fine"),
    "atol": (0.0, NAN),
    "max_step": (0.0, NAN, "x", None),
    "max_steps": (0, -3, 2.5, True, "many"),
    "events": ("never", None),
    "engine": ("turbo",),
    "output": ("rows", 3, True),
    "t_eval": (["a"], "often", 0.5),
    "initial": (5, [1.0] * 4),
    "settings": ({"rtol": 1e-3},),
}
wrong_initial: dict[str, tuple[Any, ...]] = {
    "z": (["a"] * 4,),
    "x": ("far",),
    "states": ("stick", ["stick"] * 3, None, 4),
}
rows = {
    f"{name} = {value!r}": {name: value} for name, several in wrong.items() for value in several
}
rows |= {
    f"initial {name} = {value!r}": {"initial": {name: value}}
    for name, several in wrong_initial.items()
    for value in several
}
rows |= {
    "NaN among the times": {"t_eval": [0.1, NAN]},
    "NaN among the z": {"initial": {"z": [0, 0, NAN, 0]}},
}
group("argument of simulate", running, rows)
OWN, OTHERS = ElementMachines(GIVEN), ElementMachines(stick_slip("published"))
rows = {
    "no time at all": {"t_end": 0.0},
    "end before the start": {"t_start": 1.0},
    "no step": {"method": "rk4"},
    "no step for ticks": {"events": "held"},
    "no step for events by step": {"events": "step"},
    "no rows": {"t_eval": []},
    "row behind the end": {"t_eval": [0.0, 2.0]},
    "row before the start": {"t_eval": [-0.5, 0.5]},
    "rows out of order": {"t_eval": [0.1, 0.5, 0.2]},
    "row twice": {"t_eval": [0.1, 0.5, 0.5]},
    "rows in rows": {"t_eval": [[0.1, 0.2]]},
    "t_eval without times": {"output": "t_eval"},
    "the end, and times": {"output": "end", "t_eval": [0.5]},
    "all, and times": {"output": "all", "t_eval": [0.5]},
    "unknown initial value": {"initial": {"q": [1]}},
    "too few z": {"initial": {"z": [1.0]}},
    "z that is one number": {"initial": {"z": 1.0}},
    "z with an axis more": {"initial": {"z": [[0.0] * 4]}},
    "velocity that is prescribed": {"initial": {"v": 1.0}},
    "unknown argument": {"rtoll": 1e-3},
    "compiled, and a solver of SciPy": {"engine": "compiled", "method": RK45},
    "checkpoint, and a solver of SciPy": {"checkpoint": "a", "method": RK45},
    "machines that run nothing": {"engine": "ifelse", "machines": OWN},
    "machines twice": {"engine": OWN, "machines": OWN},
    "machines of another model": {"machines": OTHERS},
    "machines of another model, compiled": {"engine": "compiled", "machines": OTHERS},
    "end beyond the clock": {"t_end": 1e10},
    "unknown state": {"initial": {"states": ["stick"] * 3 + ["glue"]}},
    "state by number": {"initial": {"states": [0, 0, 0, 0]}},
}
group("arguments of simulate", running, rows)
group(
    "arguments of simulate",
    running,
    {"checkpoint in no folder": {"checkpoint": "no/run.checkpoint"}},
)
PAIR = systems_cases.two_blocks()


def on_pads(machines: Callable[[], Any]) -> None:
    """Simulate two blocks with these machines."""
    simulate(PAIR.system, 1.0, initial=PAIR.initial, machines=machines())


def of_pad() -> ElementMachines:
    """Return machines of the first pad."""
    return ElementMachines(PAIR.system.contact("pad1"))


rows = {
    "of an unknown contact": lambda: {"pad3": of_pad()},
    "of another contact": lambda: {"pad2": of_pad()},
    "that are a contact": lambda: {"pad1": PAIR.system.contact("pad1")},
    "of several contacts": lambda: PAIR.system.contact("pad1"),
}
group("machines of a system", on_pads, rows)


@dataclasses.dataclass
class Equal(Element):
    """Elements that are equal: `transitions` would register one of them only."""

    hits: int = 0


SEEN = Chart(
    "seen",
    inputs=("P",),
    velocities=(),
    states=(State("on", outputs={"N": "P"}),),
    transitions=(Transition("again", "on", "on", event="again"),),
)
STILL = Prescribed("0")
ROOM = System("room", supervisors=(Supervisor("mode", SEEN, inputs={"P": 1.0}),), flow={"T": "1"})
ALL_EARS = dataclasses.replace(
    SEEN, transitions=tuple(Transition(f"to{k}", "on", "on", event=f"e{k}") for k in range(28))
)
EARS = System("ears", supervisors=(Supervisor("mode", ALL_EARS, inputs={"P": 1.0}),))
KICKED = Chart("kick", states=(State("on", entry={"v": "1"}, outputs={"F": "0"}),))
rows = {
    "text for a model": lambda: simulate("GMS", Prescribed("0"), 1.0),
    "class for a model": lambda: simulate(GMS, Prescribed("0"), 1.0),
    "rig before model": lambda: simulate(STILL, GIVEN, 1.0),  # type: ignore[arg-type]
    "supervisor as a contact": lambda: Contact("m", SEEN, {"mu": 0.4}),
    "input of a supervisor": lambda: System("room", supervisors=(Supervisor("mode", SEEN),)),
    "value of a system": lambda: simulate(ROOM, 1.0).value("mode.Y"),
    "class for a rig": lambda: simulate(GIVEN, Slider, 1.0),
    "class for a model of a contact": lambda: Contact("pad", GMS),
    "end under another name": lambda: simulate(GIVEN, Prescribed("0"), tend=1.0),  # type: ignore[call-arg]
    "too many jumps": lambda: simulate(GIVEN, Prescribed("mod(t, 1e-7)"), 1.0),
    "too many events": lambda: simulate(EARS, 1.0),
    "text for a rig": lambda: simulate(GIVEN, "0.1*t", 1.0),
    "argument of a session": lambda: Session(GIVEN, Prescribed("0"), 1.0, steps=3),
    "elements of no class": lambda: ElementMachines(GIVEN, dict),
    "elements that are equal": lambda: ElementMachines(GIVEN, Equal),
    "entry that sets the velocity": lambda: simulate(ChartModel(KICKED, {}), Slider(1.0, "1"), 1.0),
}
group("run", called, rows)


def showing(words: str) -> None:
    """Call a verb that shows a trace, beside one of supervisors alone."""
    simulate(ROOM, 1.0).save("run.npz")
    verb(*words.split())


rows = {
    "plot": "plot run.npz",
    "film": "animate run.npz",
    "replay of one contact": "replay run.npz --contact mode",
}
group("supervisors alone", showing, rows)
rows = {
    "end without rows": {"until": "v > 1", "output": "end"},
    "times of no events": {"events": {}},
    "time of an event": {"events": {"oil": [0.0, NAN]}},
}
rows |= {
    f"end at {text}": {"until": text} for text in ("z1 > 0.1", "F", "count(friction.slid) > 1", "")
}


def ended(events: Any = None, **how: Any) -> None:
    """Run to a condition, or to the events of a timetable."""
    if events is not None:
        timetable(events)
    simulate(GIVEN, STILL, 1.0, **how)


group("run", lambda given: ended(**given), rows)


# --------------------------------------------------------------------------- derivatives
def derived(names: Any, of: str = "v", to: str = "F_s", rig: Any = None, **how: Any) -> None:
    """Ask a run of the pulled mass for derivatives."""
    model, pulled = pulled_mass()
    trace = simulate(model, pulled if rig is None else rig, 0.1, sensitivities=names, **how)
    trace.sensitivity(of, to)


_TOUCH = {"events": "step", "max_step": 0.01}
rows = {
    "by what is unknown": lambda: derived(["F_x"]),
    "by an initial value that is unknown": lambda: derived(["initial.w"]),
    "by one number twice": lambda: derived(["F_s", "F_s"]),
    "by what stands in the text": lambda: derived(["delta"]),
    "of what is unknown": lambda: derived(["F_s"], "w"),
    "by another one": lambda: derived(["F_s"], to="k1"),
    "without any": lambda: derived([]),
    "of switches not located": lambda: derived(["F_s"], **_TOUCH),
    "until": lambda: derived(["F_s"], until="v > 1"),
    "of a Python function": lambda: derived(["F_s"], rig=Prescribed(lambda t: 0.1 * t)),
    "at other rows": (
        lambda: (
            simulate(*pulled_mass(), 0.1, sensitivities=["F_s"])
            .sample([0.05])
            .sensitivity("v", "F_s")
        )
    ),
    "cycle from nowhere": lambda: limit_cycle(*pulled_mass()),
    "cycle near no trace": lambda: limit_cycle(*pulled_mass(), near=3.0),
    "cycle without a return": lambda: limit_cycle(
        *pulled_mass(), near=simulate(*pulled_mass(), 0.1)
    ),
    "cycle through a section not crossed": lambda: limit_cycle(
        *pulled_mass(), near=simulate(*pulled_mass(), 9.0), section="v < -1"
    ),
    "cycle of what is sampled": (
        lambda: limit_cycle(
            *load_scenario("servo", []).subject[:1],
            near=simulate(*load_scenario("servo", []).subject[:1], 0.01),
            period=0.0015,
        )
    ),
    "cycle of what is driven": (
        lambda: limit_cycle(
            pulled_mass()[0],
            Slider(1.0, "sin(t)"),
            near=simulate(pulled_mass()[0], Slider(1.0, "sin(t)"), 0.5),
        )
    ),
}
group("derivatives", called, rows)


# --------------------------------------------------------------------------- sweeps
def sweeping(parameters: Any, **options: Any) -> None:
    """Sweep the pulled mass."""
    sweep(*pulled_mass(), 1.0, parameters, **{"engine": "machines", **options})


rows = {
    "unknown": {"q": [1, 2]},
    "number of another rig": {"F_a": [1, 2]},
    "no parameters": {},
    "no runs": {"F_s": []},
    "no runs, wide": {"k": np.empty((0, 4))},
    "different lengths": {"F_s": [1, 2], "k": np.ones((3, 4))},
    "too many elements": {"k": np.ones((2, 5))},
    "too deep": {"k": np.ones((2, 4, 1))},
    "wide where one is meant": {"v_c": np.ones((2, 4))},
    "words": {"F_s": ["much", "more"]},
    "ragged": {"k": [[1, 2], [1]]},
    "nothing": {"F_s": None},
    "initial value for other elements": {"initial.z": np.ones((2, 3))},
    "initial value of one element, wide": {"initial.z2": np.ones((2, 4))},
    "unknown initial value": {"initial.q": [1.0]},
    "period of what does not tick": {"friction.period": [1.0]},
    "signal of another rig": {"F_a": ["t"]},
    "one number": {"F_s": 1.5},
    "one number, wide": {"k": 1.5},
}
group("parameters of a sweep", sweeping, rows)
rows = {
    "all rows": {"output": "all"},
    "times that are missing": {"output": "t_eval"},
    "typo": {"t_evil": [0.5]},
    "parameter that varies": {"F_s": [1.5, 2.0]},
    "unknown engine": {"engine": "turbo"},
    "negative tolerance": {"rtol": -1},
    "unknown initial value": {"initial": {"q": 1}},
    "what varies, as in play": {"vary": {"F_s": (0.5, 3.0)}},
}
group("option of a sweep", lambda how: sweeping({"F_s": [1.5]}, **how), rows)


def sweeping_system(*given: Any) -> None:
    """Sweep two blocks."""
    sweep(PAIR.system, *given, initial=PAIR.initial, engine="ifelse")


rows = {
    "unknown": (1.0, {"m": [1.0]}),
    "wide": (1.0, {"pad1.F_s": [[1.5, 1.6]]}),
    "no names": (1.0, [1.0]),
    "rig": (9.0, 1.0, {"pad1.F_s": [1.0]}),
}
group("parameters of a sweep of a system", sweeping_system, rows)


# --------------------------------------------------------------------------- stepping
def started(*models: Any) -> Any:
    """Return a friction after some samples: of one joint, or a bank of several."""
    friction = FrictionBank(models) if len(models) > 1 else FrictionState(*models)
    for _ in range(7):
        friction.advance(*[0.1 if len(models) == 1 else [0.1] * len(models)] * 2, 0.3)
    return friction


def unchanged(friction: Any, call: Callable[[Any], object]) -> None:
    """Make a call that must leave the friction as it was."""
    before = repr((friction.to_array().tolist(), friction.t, friction.states, friction.switches))
    try:
        call(friction)
    finally:
        after = friction.to_array().tolist(), friction.t, friction.states, friction.switches
        assert repr(after) == before


BRISTLE = lugre()
rows = {
    "NaN": lambda f: f.advance(NAN, 0.1, 0.1),
    "infinity": lambda f: f.peek(0.1, INF, 0.1),
    "word": lambda f: f.advance("fast", 0.1, 0.1),
    "nothing": lambda f: f.advance(None, 0.1, 0.1),
    "list": lambda f: f.advance(0.1, [0.1, 0.2], 0.1),
    "back in time": lambda f: f.advance(0.1, 0.1, -1e-3),
    "NaN seconds": lambda f: f.peek(0.1, 0.1, NAN),
    "long time": lambda f: f.advance(0.1, 0.1, 1e10),
    "earlier time": lambda f: f.advance_to(0.1, 0.1, 1.0),
    "input": lambda f: f.advance(0.1, 0.1, 0.1, N=(1.0, 1.0)),
    "event": lambda f: f.send("oil"),
    "snapshot of another model": lambda f: f.restore(FrictionState(BRISTLE).snapshot()),
    "snapshot of a bank": lambda f: f.restore(FrictionBank([GIVEN]).snapshot()),
    "no snapshot": lambda f: f.restore([1.0]),
    "short array": lambda f: f.from_array(f.to_array()[:-1]),
    "array of NaN": lambda f: f.from_array(NAN * f.to_array()),
    "array that was changed": lambda f: f.from_array(f.to_array() + 0.5),
}
group("step", lambda call: unchanged(started(GIVEN), call), rows)
rows = {
    "one number": lambda b: b.advance(0.1, [0.1, 0.1], 0.1),
    "three numbers": lambda b: b.advance([0.1] * 2, [0.1] * 3, 0.1),
    "NaN": lambda b: b.advance([0.1, NAN], [0.1] * 2, 0.1),
    "back in time": lambda b: b.peek([0.1] * 2, [0.1] * 2, -1.0),
    "snapshot of three": lambda b: b.restore(FrictionBank([GIVEN] * 3).snapshot()),
    "short array": lambda b: b.from_array(b.to_array()[:-2]),
    "half an array": lambda b: b.from_array([*b.to_array()[:-5], *[0.5] * 5]),
}
group("step of a bank", lambda call: unchanged(started(GIVEN, BRISTLE), call), rows)
PUSHED = Chart("loaded", inputs=("v", "N"), states=(State("only", outputs={"F": "N * v"}),))
READS_A = Chart(
    "feels",
    states=(State("a"), State("b")),
    transitions=(Transition("go", "a", "b", guard="a > 1"),),
    outputs={"F": "v"},
)


def placed(chart: Chart | str, **more: Any) -> Contact:
    """Return a contact with a chart of one's own or an included one."""
    if isinstance(chart, Chart):
        return Contact("pad", chart, **more)
    return Contact("pad", CHARTS[chart], entry(chart).demonstration.values, **more)


PLANAR = entry("planar-coulomb").demonstration.inputs


def pressed() -> FrictionState:
    """Return a friction with the normal force as an input."""
    return FrictionState(placed(PUSHED, inputs={"N": "N_0"}))


def two_times() -> None:
    """Give a bank of two joints the state of one joint now and of the other one later."""
    bank = FrictionBank([GIVEN, GIVEN])
    now = bank.to_array()
    bank.advance(np.zeros(2), np.full(2, 0.1), 0.1)
    bank.from_array(np.concatenate([now[: now.size // 2], bank.to_array()[now.size // 2 :]]))


SAMPLED_PAD = System(
    "ticking", bodies=(Body("mass", inertia=1.0),), contacts=(Contact("pad", GIVEN, period=0.1),)
)
rows = {
    "number": lambda: linearize(3, 1.0),
    "time after the run": lambda: linearize(ran(), 2.5),
    "unknown input": lambda: linearize(ran(), 1.0, inputs="u"),
    "input that is no name": lambda: linearize(ran(), 1.0, inputs=3),
    "contact with a period": lambda: linearize(simulate(SAMPLED_PAD, 1.0), 0.5),
    "amplitude": lambda: describing_function(GIVEN, [1.0, 0.0], 1.0),
    "frequency": lambda: describing_function(GIVEN, 1.0, -1.0),
    "friction with an input": lambda: describing_function(GIVEN, 1, 1, input="v"),
    "friction that locks": lambda: describing_function(placed("stiction"), 1, 1),
    "system without an input": lambda: describing_function(SAMPLED_PAD, 1, 1),
    "input that the system has not": lambda: describing_function(
        SAMPLED_PAD, 1, 1, input="u", output="x"
    ),
}
group("linear answer", called, rows)
rows = {
    "number": lambda: Compensator(3, 1e-3),
    "period": lambda: Compensator(GIVEN, 0.0),
    "feedback": lambda: Compensator(GIVEN, 1e-3, feedback=1.5),
    "limit": lambda: Compensator(GIVEN, 1e-3, limit=-1.0),
    "gain": lambda: Compensator(GIVEN, 1e-3, gain="all"),
    "missing velocity": lambda: Compensator(GIVEN, 1, feedback=1.0).advance(0.1),
    "velocity that is NaN": lambda: Compensator(GIVEN, 1).advance(NAN),
    "velocity that is a word": lambda: Compensator(GIVEN, 1).advance("fast"),
    "measured word": lambda: Compensator(GIVEN, 1, feedback=0.5).advance(0.1, "x"),
    "friction that locks": lambda: Compensator(placed("stiction"), 1),
    "format that cannot": lambda: export(Compensator(GIVEN, 1), "js", "out", name="pad"),
}
group("compensator", called, rows)
locks = ("stiction", "karnopp", "modelica", "dog-clutch", "end-stop")
rows = {
    "number": lambda: FrictionState(3),
    "class": lambda: FrictionState(GMS),
    "late start": lambda: FrictionState(GIVEN, t=1e9),
    "length alone": lambda: FrictionState(GIVEN).advance(1e-3),
    "sample that the clock does not resolve": lambda: FrictionState(GIVEN, t=1e8).advance(
        0.1, 0.1, 1e-9
    ),
    "input with the name of an argument": lambda: FrictionState(
        placed(PUSHED, inputs={"N": "2 * dt"})
    ),
    "input that is not given": lambda: pressed().advance(0.0, 0.1, 0.1),
    "input that is no pair": lambda: pressed().peek(0, 0, 0, N_0=5.0),
    "input that is NaN": lambda: pressed().peek(0, 0, 0, N_0=(1.0, NAN)),
    "engine": lambda: FrictionState(GIVEN, engine="machines"),
    "tolerance": lambda: FrictionState(GIVEN, rtol=-1.0),
    "initial velocity": lambda: FrictionState(GIVEN, initial={"v": 1.0}),
    **{f"lock of {name}": lambda name=name: FrictionState(placed(name)) for name in locks},
    "two velocities": lambda: FrictionState(placed("planar-coulomb", v=("v", "w"), inputs=PLANAR)),
    "period": lambda: FrictionState(Contact("pad", GIVEN, period=0.1)),
    "mean before a sample": lambda: FrictionState(GIVEN).mean_force,
    "slope before a sample": lambda: FrictionState(GIVEN).dF_dv,
    "look beyond the clock": lambda: FrictionState(GIVEN).peek(0.0, 0.1, 1e15),
    "joints at different times": (two_times,),
    "empty bank": lambda: FrictionBank([]),
    "joint": lambda: FrictionBank([GIVEN, 3]),
    "initial values of two": lambda: FrictionBank([GIVEN], initial=[{}, {}]),
    "equations with a lock": lambda: FrictionEquations(placed("stiction")),
    "equations with two velocities": lambda: FrictionEquations(
        placed("planar-coulomb", v=("v", "w"), inputs=PLANAR)
    ),
    "equations with a period": lambda: FrictionEquations(Contact("pad", GIVEN, period=1e-3)),
    "equations that read the acceleration": lambda: FrictionEquations(ChartModel(READS_A, {})),
    "equations with an unknown input": lambda: FrictionEquations(placed(PUSHED)),
    "equations of a number": lambda: FrictionEquations(3),
    "equations before the first settle": lambda: FrictionEquations(GIVEN).force(
        0.0, np.zeros(5), 0.0
    ),
}
group("stepping", called, rows)


def steps() -> SystemState:
    """Return a system after a sample."""
    state = SystemState(OPEN)
    state.advance(0.3, u=0.5)
    return state


def same_after(call: Callable[[SystemState], object]) -> None:
    """Make a call that must leave the system as it was."""
    state, other = steps(), steps()
    try:
        call(state)
    finally:
        found = [(each.t, each.value("x"), each.states, each.switches) for each in (state, other)]
        assert found[0] == found[1]


OPEN = System(
    "open",
    bodies=(Body("mass", inertia=1.0, force="u - x + f"),),
    contacts=(Contact("pad", GIVEN),),
    signals={"f": "0.1 * t"},
    inputs=("u",),
)
rows = {
    "no input": lambda s: s.advance(0.1),
    "another input": lambda s: s.advance(0.1, w=1.0),
    "input too many": lambda s: s.advance(0.1, u=1.0, w=1.0),
    "NaN": lambda s: s.advance(0.1, u=NAN),
    "infinite end": lambda s: s.peek(0.1, u=(0.0, INF)),
    "three values": lambda s: s.advance(0.1, u=[1.0, 2.0, 3.0]),
    "word": lambda s: s.advance(0.1, u="fast"),
    "back in time": lambda s: s.advance(-1.0, u=1.0),
    "earlier time": lambda s: s.advance_to(0.1, u=1.0),
    "time beyond the clock": lambda s: s.advance_to(1e10, u=1.0),
    "name": lambda s: s.value("pad.z9"),
    "name of a look ahead": lambda s: s.peek(0.1, "y", u=1.0),
    "event": lambda s: s.send("oil"),
    "snapshot of a friction": lambda s: s.restore(FrictionState(GIVEN).snapshot()),
}
group("step of a system", same_after, rows)
opened = partial(dataclasses.replace, OPEN)
rows = {
    "model": lambda: SystemState(GIVEN),
    "function": lambda: SystemState(opened(signals={"f": abs}), engine="compiled"),
    "record": lambda: SystemState(opened(signals={"f": ([0, 1], [0, 1])})),
    "no location": lambda: SystemState(OPEN, events="step", max_step=0.1),
    "open run": lambda: simulate(OPEN, 1.0),
    "open session": lambda: Session(OPEN, 1.0),
    "unknown input": lambda: simulate(OPEN, 1.0, inputs={"w": 1.0}),
    "no mapping": lambda: simulate(OPEN, 1.0, inputs="1"),
    "inputs of a model": lambda: simulate(GIVEN, STILL, 1.0, inputs={"u": 1.0}),
    "input used twice": lambda: opened(inputs=("u", "x")),
    "input with a bad name": lambda: opened(inputs=("2u",)),
    "contact without a text as its name": lambda: opened(contacts=(Contact(["pad"], GIVEN),)),
    "signal with a name and a text that are wrong": lambda: opened(signals={"f": "2 *", "x": "t"}),
}
group("inputs of a system", called, rows)
AT_TICKS = {"period": 0.1, "outputs": ("u",)}


def by_function(function: Any) -> System:
    """Return a system with a controller that is a Python function."""
    return opened(inputs=(), sampled=(Sampled("pd", updates=function, **AT_TICKS),))


rows = {
    "stepped": lambda: SystemState(by_function(lambda x: x)),
    "outputs without names": lambda: Sampled("pd", period=0.1, updates=abs),
    "names for texts": lambda: Sampled("pd", updates={"u": "1"}, **AT_TICKS),
    "unknown value": lambda: simulate(by_function(lambda y: y), 1.0),
    "any values": lambda: simulate(by_function(lambda **all: 1.0), 1.0),
}
group("controllers in Python", called, rows)
rows = {
    "it raises": lambda: simulate(by_function(lambda t: 1 / t), 1.0),
    "it returns a text": lambda: simulate(by_function(lambda t: "fast"), 1.0),
}
group("a call of a controller", called, rows)
# --------------------------------------------------------------------------- sessions
FIG4 = stick_slip("published"), Prescribed(FIG4_SINE)


def on_a_belt() -> Session:
    """Return a session of a contact with a body whose velocity is given."""
    belt = Body("belt", velocity="0.1", x="x", v="w")
    return Session(System("belt", bodies=(belt,), contacts=(Contact("pad", GIVEN, v="w"),)), 1.0)


def rubber() -> Session:
    """Return a session of elements that heal after a rest."""
    return Session(HEALS, STILL, 1.0)


def rubber_pads() -> Session:
    """Return the same in a system."""
    belt = Body("belt", velocity="0.1", x="x", v="w")
    return Session(System("belt", bodies=(belt,), contacts=(Contact("pad", HEALS, v="w"),)), 1.0)


def unmoved(move: Callable[[Session], object], made: Callable[[], Session] = fig4) -> None:
    """Ask a session for a move; it stays where it is, with its branches and breakpoints."""
    session = made()
    (original,) = session.tree.forks.values()
    try:
        move(session)
    finally:
        assert session.tree.forks == {0: original}
        assert (session.here.row, len(session.branches), session.breakpoints) == (0, 1, [])


rows = {
    "break on an unknown kind": lambda s: s.break_on("fired", "arrest"),
    "break on an unknown edge": lambda s: s.break_on("fires", "arest"),
    "break on an edge that is no state": lambda s: s.break_on("enter", "arrest"),
    "break on an element too many": lambda s: s.break_on("fires", "arrest", 4),
    "break on an element below zero": lambda s: s.break_on("fires", "arrest", -1),
    "break after no hit": lambda s: s.break_on("fires", "arrest", None, "", 0),
    "break on a change of an element": lambda s: s.break_on("changes", "v", 1),
    "poke of nothing": lambda s: s.poke(),
    "poke of no element": lambda s: s.poke({"z": {}}, state={}),
    "poke of an element too many": lambda s: s.poke({"z": {4: 0.1}}),
    "poke of an unknown variable": lambda s: s.poke({"w": {0: 0.1}}),
    "poke of a number as a name": lambda s: s.poke({0: 0.1}),
    "poke of the state of an element below zero": lambda s: s.poke(state={-1: "slip"}),
    "poke of a prescribed velocity": lambda s: s.poke(v=0.1),
    "poke of a parameter": lambda s: s.poke({"F_s": {0: 2.0}}),
    "poke of how long a condition has held": (lambda s: s.poke({"duration": {0: 1.0}}), rubber),
    "poke of it in a system": (lambda s: s.poke({"pad.duration1": 1.0}), rubber_pads),
    "branch below zero": lambda s: s.switch(-1),
    "branch that is missing": lambda s: s.switch(1),
    "comparison without a parent": lambda s: s.compare(b=0),
    "why of an element too many": lambda s: s.why(4),
    "why of an unknown edge": lambda s: s.why(0, "arest"),
    "why of an edge that leaves another state": lambda s: s.why(0, "arrest"),
    "time before the start": lambda s: s.goto(-1.0),
    "time that is none": lambda s: s.goto(NAN),
    "watch that divides by zero": lambda s: s.watch("1 / x"),
    "watch of the root of a negative number": lambda s: s.watch("sqrt(-1 - x)"),
    "tree without the original run": lambda s: s.tree.delete(0),
    "tree of a missing branch": lambda s: s.tree.trace(7),
    "tree poked before the start": lambda s: s.tree.poke({"z": {0: 0.0}}, t=-1.0),
    "tree poked at the end": lambda s: s.tree.poke({"z": {0: 0.0}}, t=100.0),
    "poke of a variable by its name": lambda s: s.poke(z1=0.1),
    "poke of all elements at once": lambda s: s.poke({"z": 0.1}),
    "break on a change of a number": lambda s: s.break_on("changes", 3),
    "poke of a text": lambda s: s.poke("z"),
    "poke of a state as a text": lambda s: s.poke(state="slip"),
    "steps below zero": lambda s: s.step(-1),
    "steps back below zero": lambda s: s.back(-5),
    "tree of no name": lambda s: s.tree.rename(0, " "),
    "poke of all elements of a contact": (lambda s: s.poke({"bank.z": 1.0}), a_system),
    "negative value of a fork": lambda s: s.tree.set({"F_s": -1.0}),
    "unknown value of a fork": lambda s: s.tree.set({"q": 1.0}),
    "value of several elements of a fork": lambda s: s.tree.set({"sigma": 1.0}),
    "rows of a session": lambda s: Session(s.model, s.rig, 1.0, t_eval=[0.0, 1.0]),
    "progress of a session": lambda s: Session(s.model, s.rig, 1.0, progress=print),
    "no engine of a session": lambda s: Session(s.model, s.rig, 1.0, engine=None),
    "poke of NaN": lambda s: s.poke({"z": {0: NAN}}),
    "poke of infinity": lambda s: s.poke({"z": {0: INF}}),
    "unknown law of a fork": lambda s: s.tree.fork(law="signd"),
    "law of a system without one": (lambda s: s.tree.fork(law="signed"), locked),
    "rig of a system": (lambda s: Session(s.system, None, 2.0), a_system),
    "model without a rig": lambda s: Session(s.model, 2.0),
    "locked velocity": (lambda s: s.poke({"w1": 0.1}), a_system),
    "unknown state": lambda s: s.poke(state={0: "slipp"}),
}
group("session", unmoved, rows)
COLUMNS = {"z9 > 0": 1, "z1": 1, "state(1) == slide": 13, "z1 == 0.1": 7, "": 1, "exec(t)": 1}
rows = {
    f"condition {text!r}": lambda s, text=text: s.until(text) for text, column in COLUMNS.items()
}
group("session", unmoved, rows)
rows = {
    f"condition {text!r}": lambda s, text=text: s.until(text)
    for text in ("v > 3 mm", "z1 > 3 mm/s", "F > 2 furlong", "abs(v) > 1 m")
}
group("session", unmoved, rows)
rows = {
    "element too many": lambda s: s.until("state(9) == slip"),
    "break on a change of what is unknown": lambda s: s.break_on("changes", "z9 + 1"),
    "break on a change of a state of no element": lambda s: s.break_on("changes", "state(9)"),
    "break on a change of a state without its number": lambda s: s.break_on("changes", "state"),
    "way back to what is unknown": lambda s: s.until("z9 > 0", back=True),
    "condition of a breakpoint": lambda s: s.break_on("fires", "arrest", None, "z9 > 0"),
    "name without its contact": (lambda s: s.parse("F > 1"), a_system),
    "variable without its element": (lambda s: s.parse("bank.z > 1"), a_system),
    "state without its contact": (lambda s: s.parse("state(1) == stuck"), a_system),
    "state without its element": (lambda s: s.parse("bank.state == slip"), a_system),
    "poke of a number": (lambda s: s.poke({"m": 2.0}), a_system),
    "poke of a signal": (lambda s: s.poke({"r": 2.0}), a_system),
    "poke of a given velocity": (lambda s: s.poke({"belt.v": 1.0}), on_a_belt),
    "why of an element too many of a contact": (lambda s: s.why("bank 9"), a_system),
    "poke of a parameter of a contact": (lambda s: s.poke({"pad.F_c": 2.0}), a_system),
    "poke of a missing body": (lambda s: s.poke({"load.x": 2.0}), a_system),
    "poke of an element too many of a contact": (lambda s: s.poke({"bank.z": {4: 1.0}}), a_system),
    "poke of the velocity of no body": (lambda s: s.poke(v=1.0), a_system),
    "state of no contact": (lambda s: s.poke(state={0: "stuck"}), a_system),
    "state of a contact with several elements": (
        lambda s: s.poke(state={"bank": "slip"}),
        a_system,
    ),
    "force without its contact": (lambda s: s.here.F, a_system),
    "missing contact": (lambda s: s.here.contact("gear"), a_system),
    "break on an edge of another contact": (
        lambda s: s.break_on("fires", "arrest", "pad"),
        a_system,
    ),
    "break on a missing contact": (lambda s: s.break_on("fires", "arrest", "gear 1"), a_system),
}
group("session", unmoved, rows)


def editing(request: str, *, launched_first: bool = True, **given: object) -> object:
    """Make a request of an editor."""
    adapter = Adapter(launched, lambda *_: None, lambda: False)
    if launched_first:
        adapter.answer("launch", {"program": "pulled_mass"})
    return adapter.answer(request, given)


def framed(body: bytes) -> object:
    """Read a message with this body."""
    return read_message(io.BytesIO(b"Content-Length: %d\r\n\r\n%b" % (len(body), body)))


early = partial(editing, launched_first=False)
rows = {
    "no scenario": partial(early, "launch"),
    "settings that are no list": partial(early, "launch", program="servo", set="a=1"),
    "unknown request": partial(editing, "restart"),
    "request before the launch": partial(early, "stackTrace"),
    "paths that are URIs": partial(early, "initialize", pathFormat="uri"),
    "expression that is no text": partial(editing, "evaluate", expression=3),
    "file without a path": partial(editing, "setBreakpoints", source={}),
    "frame of no row": partial(editing, "scopes", frameId=99),
    "scope of before": partial(editing, "variables", variablesReference=9),
    "message that is not JSON": lambda: framed(b"x"),
    "message that is no object": lambda: framed(b"[]"),
}
group("editor", called, rows)


def damaged(**changes: Any) -> None:
    """Load a session file with some parts changed, or left out (...)."""
    path = fig4(5.0).save("s.json")
    data = json.loads(path.read_text()) | changes
    path.write_text(json.dumps({name: part for name, part in data.items() if part is not ...}))
    Session.load(path)


FORK = {"fork": -1, "edits": {}, "cursor": 0, "from": None, "between": None}
ORIGINAL = {"parent": None, **FORK}
rows = {
    "unknown law": {"branches": [ORIGINAL, {"parent": 0, **FORK, "law": "another"}]},
    "parent of itself": {"branches": [ORIGINAL, {"parent": 1, **FORK}]},
    "null for branches": {"branches": None},
    "current that is missing": {"current": 7},
    "current that is a word": {"current": "one"},
    "end before the start": {"t_end": -1.0},
    "empty header": {"header": {}},
    "unknown method": {"options": {"method": "rk5"}},
    "breakpoint of an unknown kind": {"breakpoints": [{"kind": "fired", "name": "arrest"}]},
    "breakpoint of half a condition": {
        "breakpoints": [{"kind": "fires", "name": "arrest", "condition": "z9 >"}]
    },
    "number for watches": {"watches": 5},
    **{f"no {key}": {key: ...} for key in ("header", "t_end", "options", "branches", "current")},
}
group(
    "session file", lambda given: damaged(**given), {name: (given,) for name, given in rows.items()}
)


def session_file(text: str) -> None:
    """Load this text as a session."""
    Path("odd.json").write_text(text)
    Session.load("odd.json")


rows = {
    f"text {text!r}": (text,)
    for text in ("", "{", "[]", "null", "{}", '{"format": "other"}', "\0", "title = 'a scenario'")
} | {"format alone": '{"format": "gms-fsm session 1"}'}
group("session file", session_file, rows)
rows = {"missing file": "nothing.json", "folder": "."}
group("session file", Session.load, rows)


def drawn_by_hand() -> Session:
    return Session(stick_slip("signed"), Prescribed(lambda t: 0.1 * t), 3.0)


rows = {
    "function": (drawn_by_hand,),
    "method of SciPy": lambda: Session(*FIG4, 1.0, method=scipy.integrate.Radau),
}
group("saved session", lambda made: made().save("s.json"), rows)


def exported(session: Session, name: str = "branch.toml", **poked: Any) -> None:
    """Write the current branch as a scenario, poked before if anything is given."""
    if poked:
        session.tree.poke(**poked)
    session.tree.save_scenario(name)


rows = {
    "session in a missing folder": lambda: fig4().save("no/folder/s.json"),
    "scenario with another ending": lambda: exported(fig4(), "one.json"),
}
group("saved", called, rows)
rows = {
    "ticks": lambda: exported(a_system(), variables={"one.x": 0.1}, t=1.0),
    "poke that a failed run does not reach": lambda: exported(
        Session(*FIG4, 40.0, max_steps=60), variables={"z": {0: 0.1}}, t=39.0
    ),
}
group("exported session", called, rows)


# --------------------------------------------------------------------------- proofs
TWO_PADS = System(
    "pads",
    bodies=(Body("body", inertia=1.0),),
    contacts=(Contact("pad", FIG4[0]), Contact("other", FIG4[0])),
)
rows = {
    "quotient in its domain": lambda: prove(gms_element("signed"), ["z / s > 1"]),
    "no chart": lambda: prove(3),  # type: ignore[arg-type]
    "contact of a chart": lambda: prove(gms_element("signed"), contact="pad"),
    "which contact": lambda: prove(TWO_PADS),
    "unknown contact": lambda: prove(TWO_PADS, contact="pat"),
}
group("prove", called, rows)
rows = {
    "no chart": lambda: diff(3, gms_element("signed")),  # type: ignore[arg-type]
    "path": lambda: diff(gms_element("signed"), "a.toml"),  # type: ignore[arg-type]
    "chart and system": lambda: diff(gms_element("signed"), TWO_PADS),
    "model and run": lambda: diff(FIG4[0], simulate(*FIG4, 1.0)),
}
group("diff", called, rows)


# --------------------------------------------------------------------------- tables of results
NOTHING_SHOWN = PhenomenonResult("does not show", (), "")
rows = {
    "number": lambda: NOTHING_SHOWN.number("loss"),
    "cell": lambda: PhenomenaTable({}, (), ()).cell("lugre", "memory"),
    "draws": lambda: Bootstrap(("k1",), np.zeros((3, 1))).interval("k2"),
    "two directions on a bench": lambda: measure_phenomena(
        {"mine": placed("planar-coulomb", v=("v", "w"), inputs=PLANAR)}
    ),
}
group("result without it", called, rows)


# --------------------------------------------------------------------------- trace files
BELT = "every kind of contact"


@cache
def ran(name: str = "") -> Trace:
    """Return a short run, or one of the corpus."""
    return trace(name) if name else simulate(stick_slip("signed"), Prescribed("0.3"), 2.0)


@cache
def saved(ending: str, name: str = "") -> Mapping[str, bytes]:
    """Return the files of a run."""
    with tempfile.TemporaryDirectory() as folder:
        ran(name).save(Path(folder) / f"run{ending}")
        return {path.name: path.read_bytes() for path in sorted(Path(folder).iterdir())}


def archive(
    change: Callable[[dict[str, Any]], object], file: str = "run.npz", name: str = ""
) -> None:
    """Load the arrays of an archive, one of them changed."""
    with np.load(io.BytesIO(saved(".npz", name)["run.npz"])) as npz:
        arrays = dict(npz)
    change(arrays)
    with Path(file).open("wb") as out:
        np.savez(out, **arrays)
    Trace.load(file)


def array(name: str, change: Callable[[Any], Any]) -> None:
    """Load an archive with one array changed; of stops, which are added first."""

    def to(arrays: dict[str, Any]) -> None:
        if name.startswith("stops"):
            for each in ("t", "microstep", "y", "mode"):
                arrays[f"stops_{each}"] = arrays[f"rows_{each}"]
        arrays[name] = change(arrays[name])

    archive(to)


def header(*path: Any) -> None:
    """Load an archive with one place of its header changed to the last argument."""
    *keys, last, value = path

    def to(arrays: dict[str, Any]) -> None:
        whole = place = json.loads(str(arrays["header"]))
        for key in keys:
            place = place[key]
        place[last] = value
        arrays["header"] = np.array(json.dumps(whole))

    archive(to)


def format_1(change: Callable[[Any], Any], name: str = "") -> None:
    """Load a file of format 1 with another log."""
    arrays = older_files.format_1(ran(name), Path("run.npz"))
    arrays["transitions"] = change(arrays["transitions"])
    Trace.load(older_files.write(Path("run.npz"), arrays))


def cell(column: str, value: Any) -> Callable[[Any], Any]:
    """Return a change of one cell of the log."""

    def to(log: Any) -> Any:
        log[column][1] = value
        return log

    return to


def lines(change: Callable[[list[str]], object], name: str = "run.csv") -> None:
    """Load a CSV trace with some lines changed."""
    for each, content in saved(".csv").items():
        Path(each).write_bytes(content)
    text = Path(name).read_text(encoding="utf-8").split("\n")
    change(text)
    Path(name).write_text("\n".join(text), encoding="utf-8")
    Trace.load("run.csv")


def replaced(line: int, old: str, new: str, name: str = "run.csv") -> None:
    """Load a CSV trace with a text in a line replaced."""

    def to(text: list[str]) -> None:
        assert old in text[line]
        text[line] = text[line].replace(old, new, 1)

    lines(to, name)


def files(contents: Mapping[str, bytes], path: str = "run.csv") -> None:
    """Load a trace from these files."""
    for name, content in contents.items():
        Path(name).write_bytes(content)
    Trace.load(path)


LOG = "run.transitions.csv"
rows = {
    "y has a column too few": ("rows_y", lambda a: a[:, :-1]),
    "y is flat": ("rows_y", lambda a: a[:, 0]),
    "y of a stop has a column too few": ("stops_y", lambda a: a[:, :-1]),
    "y holds text": ("rows_y", lambda a: a.astype("U32")),
    "t is shorter": ("rows_t", lambda a: a[:-1]),
    "t is one number": ("rows_t", lambda a: np.float64(0)),
    "t goes backward": ("rows_t", lambda a: a[::-1]),
    "t is not finite": ("rows_t", lambda a: a * np.nan),
    "microstep is shorter": ("rows_microstep", lambda a: a[:-1]),
    "microstep without a firing": ("rows_microstep", lambda a: a + 9),
    "microstep is huge": ("rows_microstep", lambda a: a + np.int64(2**40)),
    "state number is too large": ("rows_mode", lambda a: a + 2),
    "state numbers are text": ("rows_mode", lambda a: a.astype("U4")),
    "state numbers are fractions": ("rows_mode", lambda a: a + 0.5),
    "state number of a stop": ("stops_mode", lambda a: a + 7),
    "F holds text": ("observed_F", lambda a: a.astype("U32")),
    "s has a column too few": ("observed_s", lambda a: a[:, :-1]),
    "times of the log are text": ("log_t", lambda a: a.astype("U32")),
    "times of the log are not finite": ("log_t", lambda a: a * NAN),
    "times of the log are late": ("log_t", lambda a: a + 9e9),
    "edges are fractions": ("log_edge", lambda a: a + 0.5),
    "edges are negative": ("log_edge", lambda a: a.astype(np.int64) - 1),
    "edges are huge": ("log_edge", lambda a: a.astype(np.uint64) + 2**63),
    "edges are 2**32 too large": ("log_edge", lambda a: a.astype(np.int64) + 2**32),
    "machine too many": ("log_machine", lambda a: a + 99),
    "numbers of the log are one too few": ("log_numbers", lambda a: a[:, :-1]),
    "header is numbers": ("header", lambda a: np.zeros(3)),
    "header is an object": ("header", lambda a: np.array({}, dtype=object)),
    "header is no JSON": ("header", lambda a: np.array("{not json")),
    "header is a list": ("header", lambda a: np.array("[]")),
    "header is deep": ("header", lambda a: np.array("[" * 100_000)),
}
group("array of a trace file", array, rows)
rows = {
    "no header": lambda a: a.pop("header"),
    "no dz": lambda a: a.pop("observed_dz"),
    "no log": lambda a: a.pop("log_t"),
    "no edges": lambda a: a.pop("log_edge"),
    "no rows": lambda a: a.update({n: v[:0] for n, v in a.items() if n[:3] in ("row", "obs")}),
    "slide flag": (lambda a: a["rows_mode"].__setitem__((0, -1), 2), "run.npz", BELT),
    "another ending": (lambda a: None, "run.txt"),
    "no ending": (lambda a: None, ".npz"),
}
group("archive", archive, rows)
rows = {
    "another format": ("format", "gms-fsm trace 99"),
    "unknown key": ("surprise", 1),
    "no elements": ("model", "n", 0),
    "more elements than weights": ("model", "n", 5),
    "very many elements": ("model", "n", 10**15),
    "weights that are none": ("model", "weights", ["heavy"]),
    "value that is missing": ("model", "values", {}),
    "value that is text": ("model", "values", "k", "stiff"),
    "F_c of zero": ("model", "stribeck", "F_c", 0),
    "curve that is missing": ("model", "stribeck", None),
    "unknown rig": ("rig", "title", "a cart"),
    "rig without its numbers": ("rig", "title", "slider pulled through a spring"),
    "signal that is missing": ("rig", "signals", {}),
    "signal of no kind": ("rig", "signals", "v", {"kind": "magic"}),
    "signal that cannot be read": ("rig", "signals", "v", {"kind": "formula", "text": "t +"}),
    "signal that runs backward": (
        "rig",
        "signals",
        "v",
        {"kind": "corners", "times": [1, 0], "values": [0, 0], "held": True},
    ),
    "flow that runs code": (
        "model",
        "chart",
        "states",
        0,
        "flow",
        "z",
        "__import__('os').getpid()",
    ),
    "guard that runs code": ("model", "chart", "transitions", 0, "guard", "exec('1') > 0"),
    "state whose name runs code": ("model", "chart", "states", 0, "name", "x = 1\nimport os"),
    "parameter that is no name": ("model", "chart", "parameters", ["k", "sigma", "C", "v = 1; a"]),
    "edge to nowhere": ("model", "chart", "transitions", 0, "target", "nowhere"),
    "input no model supplies": ("model", "chart", "inputs", ["v", "s", "u"]),
}
group("header of a trace file", header, rows)
rows = {
    "other columns": lambda a: np.zeros(3, dtype=[("a", "f8")]),
    "two axes": lambda a: a[:, None],
    "element too many": lambda a: np.array([(0.0, 99, *list(r)[2:]) for r in a], a.dtype),
    "names of contacts": lambda a: np.zeros(3, [*a.dtype.descr, ("contact", a.dtype["edge"])]),
    "unknown edge": cell("edge", "nowhere"),
    "source of another edge": cell("source", "slip"),
    "unknown target": cell("target", "x"),
    "time that is not finite": cell("t", NAN),
}
group("log of format 1", format_1, rows)
rows = {
    "bad JSON": (0, '"model"', "model"),
    "missing column": (1, ",v,", ",u,"),
    "missing state column": (1, "state2", "stateB"),
    "column twice": (1, ",v,", ",x,"),
    "word for a number": (3, ",0,", ",soon,"),
    "unknown state": (3, "stick", "glue"),
    "fraction of a micro-step": (3, ",0,", ",0.5,"),
    "huge micro-step": (3, ",0,", f",{10**30},"),
    "endless cell": (3, ",0,", f",{'0' * 200_000},"),
    "hostile flow": (0, '"z": "v"', '"z": "__import__(\'os\').getpid()"'),
    "short row": (3, ",", ""),
    "long row": (3, ",", ",,"),
    "log without a column": (0, "edge", "ledge", LOG),
    "log with a short row": (1, ",", "", LOG),
    "log with a word for a number": (1, ",1,", ",one,", LOG),
    "log with a huge element": (1, ",1,", f",{10**30},", LOG),
}
group("line of a CSV trace", replaced, rows)
rows = {
    "no header": lambda text: text.pop(0),
    "no head line": lambda text: text.pop(1),
    "deep JSON": lambda text: text.__setitem__(0, "# {" + '"a":[' * 50_000),
    "only a header": lambda text: text.__delitem__(slice(1, None)),
}
group("lines of a CSV trace", lines, rows)
rows = {
    "log for the trace": lambda: {"run.csv": saved(".csv")[LOG]},
    "no log": lambda: {"run.csv": saved(".csv")["run.csv"]},
    "empty log": lambda: {**saved(".csv"), LOG: b""},
    "no text": lambda: {**saved(".csv"), "run.csv": b"# {\xff\xfe\x00}"},
    "log that is no text": lambda: {**saved(".csv"), LOG: b"\xff\xfe\x00"},
    "missing archive": (lambda: {}, "none.npz"),
    "missing CSV": (lambda: {}, "none.csv"),
    "archive cut in half": (lambda: {"run.npz": saved(".npz")["run.npz"][:2000]}, "run.npz"),
    "archive cut to nothing": (lambda: {"run.npz": b""}, "run.npz"),
    "archive without its end": (lambda: {"run.npz": saved(".npz")["run.npz"][:-20]}, "run.npz"),
}
group("files of a trace", lambda contents, *path: files(contents(), *path), rows)


# --------------------------------------------------------------------------- systems
SYSTEM_FILE = """\
name = "pair"
numbers = { m = 1.0 }
flow = { i = "(r - i) / 0.1" }
[signals]
r = "m * sin(t)"
q = [[0, 0], [1, 2]]
[[body]]
name = "one"
inertia = "m"
force = "q - x1 + i"
x = "x1"
v = "v1"
[[body]]
name = "two"
inertia = 2
x = "x2"
v = "v2"
[[contact]]
name = "gear"
v = "v1 - 2 * v2"
chart = "lugre"
values = { sigma_0 = 1e3, sigma_1 = 31.6 }
inputs.s = 1
[[contact]]
name = "pad"
v = "v2"
[contact.model]
kind = "GMS"
law = "signed"
preset = "stick-slip"
[[sampled]]
name = "pid"
period = 1e-3
updates.u = "m * x1"
[[spring]]
name = "shaft"
first = "one"
second = "two"
k = "2 * m"
d = 0.5
ratio = 3
rest = "r"
"""


def system_file(old: str, new: str) -> None:
    """Load an edited system file beside a broken chart file."""
    Path("a.toml").write_text('name = "a"\n[[state]]\nname = "b"\noutputs.F = "q"')
    Path("own.toml").write_text(changed(SYSTEM_FILE, old, new), encoding="utf-8")
    System.load("own.toml")


STICTION_CHART = CHARTS["stiction"]
WELD = Chart("weld", states=(State("held", locked=True),))
DRY = {"F_c": 1.0, "F_s": 1.5, "b": 0.0}


def system(*, body: Mapping[str, Any] | None = None, **more: Any) -> System:
    """Return a mass with stiction, with other parts."""
    mass = Body("mass", **{"inertia": 1.0, **(body or {})})
    contacts = (Contact("pad", STICTION_CHART, DRY),)
    return System("one", **{"bodies": (mass,), "contacts": contacts, **more})


def pid(period: float = 1e-3, **updates: str) -> tuple[Sampled, ...]:
    """Return a sampler."""
    return (Sampled("pid", period=period, updates=updates),)


def pad(**inputs: str) -> Contact:
    """Return a contact with inputs."""
    return Contact("pad", stick_slip("signed"), inputs=inputs)


def saved_system(signal: Any) -> None:
    """Save a system with a signal."""
    system(signals={"r": signal}).save("own.toml")


def named(name: str, kind: str) -> None:
    """Run a rig with a number or a signal of this name."""

    class Pushed:
        title, acceleration = "pushed", f"{name} * sin(t) - F"
        numbers = {name: 2.0} if kind == "number" else {}
        signals = {name: as_signal("2 * t")} if kind == "signal" else {}

    simulate(stick_slip("signed"), Pushed(), 3.0)


rows = {
    "an inertia": ('"m"\nforce', '"mm"\nforce'),
    "a force": ("q - x1", "q - x9"),
    "an unknown velocity": ('v = "v2"\n[c', 'v = "v3"\n[c'),
    "an input": ("inputs.s = 1", 'inputs.s = "z9"'),
    "a signal": ("m * sin", "M * sin"),
    "a flow": ('"(r - i) /', '"(r - i /'),
    "an update": ("m * x1", "m * y1"),
    "a stiffness": ("2 * m", "2 * x1"),
    "a ratio": ("ratio = 3", 'ratio = "t"'),
    "a rest": ('rest = "r"', 'rest = "v1"'),
    "a chart file": ('"lugre"', '"a.toml"'),
    "no inertia": ("inertia = 2\n", ""),
    "zero inertia": ("inertia = 2", "inertia = 0"),
    "a velocity": ("v1 - 2 * v2", "v1 * v2"),
    "an unread input": ("inputs.s", "inputs.q"),
    "an unbound input": ("inputs.s = 1\n", ""),
    "a value": ("31.6", "-31.6"),
    "an unknown chart": ('"lugre"', '"lugree"'),
    "no chart": ('chart = "lugre"\n', ""),
    "a name used twice": ('"x2"', '"x1"'),
    "a contact's name": ('"pad"', '"gear"'),
    "a period": ("1e-3", "0"),
    "an end": ('second = "two"', 'second = "tow"'),
    "the same end": ('second = "two"', 'second = "one"'),
    "a negative stiffness": ('"2 * m"', '"-2 * m"'),
    "a negative damping": ("d = 0.5", "d = -0.5"),
    "a spring of nothing": ('k = "2 * m"\nd = 0.5\n', ""),
    "a spring's name": ('"shaft"', '"two"'),
    "a preset": ("stick-slip", "stick"),
    "an unknown model": ('"GMS"', '"GMs"'),
    "a number": ("{ m = 1.0 }", '{ m = "1" }'),
    "an unknown key": ("inertia = 2", "inertia = 2\nmass = 1"),
    "an unknown motion": ("inertia = 2", 'inertia = 2\nmotion = "rotary"'),
    "an unknown table": ("[[sampled]]", "[[sample]]"),
    "a scenario of a system": ('name = "pair"', 'name = "pair"\nrun.t_end = 1.0'),
    "a model on a rig": ('name = "pair"', 'rig.kind = "prescribed"\nname = "pair"'),
}
group("system file", system_file, rows)
rows = {"scenario of the package": "servo"}
group("system file", System.load, rows)
FUNCTION = '{ kind = "function" }'
rows = {
    "a chart elsewhere": ('"lugre"', '"../a.toml"'),
    "a function": ("[[0, 0], [1, 2]]", FUNCTION),
    "ramps": ("[[0, 0]", "[[5, 0]"),
    "no chart file": ('"lugre"', '"b.toml"'),
}
group("system file", system_file, rows)


def made(**parts: Any) -> None:
    """Make a system, and run it."""
    simulate(system(**parts), 1.0)


def accelerated(acceleration: str) -> None:
    """Run a rig with an acceleration of its own."""
    rig = SimpleNamespace(title="own", acceleration=acceleration, numbers={}, signals={})
    simulate(stick_slip("signed"), rig, 1.0)  # type: ignore[arg-type]


def other_number() -> None:
    """Give a rig that was read a number that is infinite."""
    rigs = [
        SimpleNamespace(title="own", acceleration="(t - F) / m", numbers={"m": m}, signals={})
        for m in (1.0, INF)
    ]
    model = stick_slip("signed")
    with_model(mounted(model, rigs[0]).system, model, rigs[1])  # type: ignore[arg-type]


TWICE = Contact("a", WELD), Contact("b", WELD)
DAHL = Contact("p", CHARTS["dahl"], {"sigma_0": 1.0, "F_c": 1.0}, inputs={"N": "5"})
DIFFERENCE = {"inertia": "a - b"}
MOVING = Prescribed("0.1")
rows = {
    "offset in v": {"contacts": (Contact("pad", WELD, v="v + 1"),)},
    **{
        f"{text} in v": {
            "contacts": (Contact("pad", WELD, v=f"v + {text}"),),
            "numbers": {"m": 1.0},
        }
        for text in ("1 / m", "exp(m)")
    },
    "number among the bodies": {"bodies": (Body("mass", inertia=1.0), 3)},
    "negative": {"body": DIFFERENCE, "numbers": {"a": 1.0, "b": 2.0}},
    "no number": {"body": {"inertia": "1 / m"}, "numbers": {"m": 0.0}},
    "motion": {"body": {"motion": "rotary"}},
    "rotary": {"body": {"rotary": 1}},
    "turns and moves": {"body": {"motion": "normal", "rotary": True}},
    "unit of nothing": {"units": {"r": "m"}},
    "unit with a prefix": {"numbers": {"r": 1.0}, "units": {"r": "mm"}},
    "velocity of other units": {
        "body": {"rotary": True},
        "contacts": (Contact("p", WELD, v="r * v"),),
        "numbers": {"r": 1.0},
        "units": {"r": "N"},
    },
    "stiffness": {"springs": (Spring("s", "mass", k="-a"),), "numbers": {"a": 1.0}},
    "locks that repeat": {"contacts": TWICE},
    "load without a curve": {"contacts": (DAHL,)},
    "period": {"sampled": pid(u="period"), "numbers": {"period": 2.0}},
    "let of a name that is taken": {"let": {"t": "1"}},
    "driven body alone": {"body": {"inertia": None, "velocity": "1"}},
    "samplers without number": {
        "sampled": [Sampled(f"s{i}", period=0.1, updates={f"u{i}": "1"}) for i in range(63)]
    },
    "ticks without number": {"sampled": pid(1e-9, u="x")},
}
group("system", lambda given: made(**given), rows)
rows = {
    "values beside a model": lambda: Contact("pad", stick_slip("signed"), DRY),
    "delay of an expression": lambda: pid(u="delay(2 * x, 3)"),
    "delay by nothing": lambda: pid(u="delay(x, 0)"),
    "start of what is not updated": partial(
        Sampled, "pid", period=1, updates={"u": "1"}, initial=DRY
    ),
    "number of another rig of the same shape": other_number,
    **{f"acceleration {text}": partial(accelerated, text) for text in ("t", "F * F", "sin(F)")},
}
group("part of a system", called, rows)
rows = {
    key: lambda key=key: simulate(load_system("servo"), 0.1, initial={key: 1.0})
    for key in ("load.y", "w", "bearing.state")
}
group("initial value of a system", called, rows)
rows = {"pairs in a pair": (((0.0, 0.0), (1.0, 2.0)),)}
group("signal", Prescribed, rows)
rows = {
    "force of a contact": {"body": {"force": "F"}},
    "force in an update": {"sampled": pid(u="2 * F")},
    "let that reads a later one": {"let": {"a": "b", "b": "1"}},
}
group("system", lambda given: made(**given), rows)
rows = {
    "bank": partial(ChartModel, n=2),
    "on a prescribed motion": lambda *model: simulate(ChartModel(*model), MOVING, 1.0),
    "start in motion": lambda *_: simulate(system(), 1.0, initial={"v": 0.3}),
}
group("lock", lambda call: call(STICTION_CHART, DRY), rows)
rows = {name: (name,) for name in "svt"}
group("input of a contact", lambda name: pad(**{name: "5"}), rows)
rows = {"state that gives way": edge(impulse=True)}
group("impulse", chart, rows)
rows = {"function": (abs,), "very long record": ((TIMES := np.arange(60_000) / 7.0, TIMES),)}
group("saved system", saved_system, rows)

CALLED = dict.fromkeys("xvtF", "'pushed'") | dict.fromkeys(("exp", "pi"), "system 'pushed', KIND")
rows = {
    f"{kind} called {name}": (name, kind)
    for name, place in CALLED.items()
    for kind in ("number", "signal")
}
group("name of a rig", named, rows)


# --------------------------------------------------------------------------- signals
def starting(t_start: float) -> None:
    """Run over a record from 1 to 3 s."""
    rig = Prescribed(([1.0, 2.0, 3.0], [0.0, 0.1, 0.2]))
    simulate(stick_slip("signed"), rig, 5.0, t_start=t_start)


HUGE = 10**400
WRONG: tuple[Any, ...] = (
    *(None, True, [], {}, [0, 1, 2], [(0, 1, 2)], [(0, 1), (2,)], [[0, 1, 2], [0.0, 0.1, 0.0]]),
    *(([0, 1, 2], [0, 1]), ([0], [1]), [(0, 1)], ([], []), ([0, 2, 1], [0, 0, 0])),
    *([(0, 0), (2, 0), (1, 0)], ([0, NAN, 2], [0, 0, 0]), ([0, 1], [0, INF]), NAN),
    *(([0, 1], ["a", "b"]), ([[0, 1]], [0, 1]), (0, 1)),
)
rows = {repr(signal): (signal,) for signal in WRONG} | {
    "an array of two rows": np.zeros((2, 3)),
    "a number of 400 digits": (HUGE,),
    "ramps to it": [(0, HUGE), (1, 0)],
    "a record of it": (([0, 1], [0, -HUGE]),),
    "very many words": ["x"] * 100_000,
}
group("signal", Prescribed, rows)
rows = {text: (text,) for text, column in {"t > 1": 1, "t.real": 1, "sin(x)": 5, "t +": 4}.items()}
group("signal", Prescribed, rows)
rows = {"of nothing": ""}
group("signal", Prescribed, rows)
rows = {"two numbers": lambda t: np.array([0.1, 0.2]), "nothing": lambda t: None}
group("function of time", lambda v: simulate(GIVEN, Prescribed(v), 1.0), rows)
rows = {f"{t} s": (t,) for t in (0.999, 3.0)}
group("start of a record", starting, rows)


# --------------------------------------------------------------------------- built-in charts
def entry_of(made_of: Any, values: Mapping[str, Any], stribeck: Stribeck | None = None) -> Entry:
    """Return an entry of the registry."""
    return Entry("mine", made_of, Demonstration(values, "", stribeck=stribeck))


rows = {repr(law): (law,) for law in ("Published", "", None, 1)}
group("law of the GMS element", gms_element, rows)
rows = {
    "gms without a law": lambda: entry("gms").chart(""),
    "gms with an unknown law": lambda: entry("gms").chart("al-bender"),
    "GMS with an unknown law": lambda: GMS(bank(), law="fair"),
    "lugre with a law": lambda: entry("lugre").chart("signed"),
    "unknown": lambda: entry("coulomb"),
    "curve that is not read": lambda: ChartModel(one_state("k"), {"k": 1.0}, stribeck=1.0),
}
group("built-in chart", called, rows)

rows = {
    "missing value": (CHARTS["lugre"], {"sigma_0": 1.0}, STRIBECK),
    "no curve": (CHARTS["lugre"], {"sigma_0": 1.0, "sigma_1": 0.0}),
    "curve that is not read": (one_state(), {}, STRIBECK),
    "unknown value": (one_state(), {"k": 1.0}),
    "value against its rule": (one_state(Parameter("k", "N/m", "> 0")), {"k": 0.0}),
    "name of a key": (one_state("law"), {"law": 0.0}),
    "no chart": ({}, {}),
    "laws with other parameters": ({"a": one_state("k"), "b": one_state()}, {"k": 0.0}),
}
group("entry of a chart", entry_of, rows)
rows = {str(delta): (delta,) for delta in (0.0, 0.05, 21.0, NAN)}
group("exponent of a curve", lambda delta: curve(delta=delta), rows)

rows = {
    "F_s": (curve, {"F_s": 10**400}),
    "k": (bank, {"k": [10**400, 1]}),
    "very many words": (curve, {"F_c": ["x"] * 100_000}),
}
group("number that no float holds", lambda make, given: make(**given), rows)


# --------------------------------------------------------------------------- traces of systems
def edge_of_another(arrays: dict[str, Any]) -> None:
    """Let the first contact take an edge of the second."""
    arrays["log_edge"][np.flatnonzero(arrays["log_machine"] == 0)[0]] = len(
        CHARTS["stiction"].transitions
    )


def no_system(arrays: dict[str, Any]) -> None:
    header = json.loads(str(arrays["header"]))
    del header["system"]
    arrays["header"] = np.array(json.dumps(header))


def no_trace(kind: str) -> None:
    """Load a folder, or a single array."""
    if kind == "array":
        with Path("run.npz").open("wb") as file:
            np.save(file, np.zeros(3))
    elif kind == "out":
        Path("out/own").mkdir(parents=True)
        Path("out/own/trace.npz").touch()
    else:
        Path(f"run.{kind}").mkdir()
    Trace.load({"array": "run.npz", "out": "out"}.get(kind, f"run.{kind}"))


def watched(monitor: Any) -> None:
    """Run a system with a monitor."""
    run(BELT)(monitors=[monitor])


def rows_wanted(monitor: str) -> None:
    """Keep the end only of a run with a monitor that needs its rows."""
    simulate(stick_slip("signed"), Prescribed(0.2), 1.0, output="end", monitors=monitor)


rows = {
    "contact": (cell("contact", "none"), BELT),
    "edge": (cell("edge", "break_away_forward"), BELT),
    "element": (cell("element", 1), BELT),
}
group("log of a system of format 1", format_1, rows)
rows = {
    "edge of another contact": (edge_of_another, "run.npz", BELT),
    "no system": (no_system, "run.npz", BELT),
}
group("archive of a system", archive, rows)
rows = {"array": "array", "folder": "npz", "CSV": "csv", "folder of runs": "out"}
group("no trace", no_trace, rows)
rows = {"what one contact sees": "pad"}
group("saved trace", lambda name: ran(BELT).contact(name).save("run.npz"), rows)
rows = {
    "unknown contact": "gear: all",
    "unknown contact of an object": CoverageMonitor("gear"),
    "no contact": "F < 2",
    "name of the system for a contact": "pad: q1 < 2",
}
group("monitors of a system", watched, rows)
rows = {each: (each,) for each in ("passivity", "coverage", "z <= s")}
group("monitors of the end", rows_wanted, rows)
rows = {
    "in a session": lambda: Session(
        stick_slip("signed"), Prescribed(0.2), 5.0, monitors=["coverage"]
    )
}
group("monitors", called, rows)


# --------------------------------------------------------------------------- coverage
def counted(v: str = "0.2", law: str = "signed") -> Coverage:
    """Count the coverage of a short run."""
    return coverage(simulate(stick_slip(law), Prescribed(v), 1.0))


def swept_and_saved() -> Sweep:
    """Read a sweep from its file."""
    given: Any = (stick_slip("signed"), Prescribed("0.2"), 1.0, {"F_s": [1.5]})
    return Sweep.load(sweep(*given, engine="machines").save("swept.npz"))


def covering(*words: str) -> None:
    """Call ``gms-fsm cover`` beside counts of another chart, and counts that are damaged."""
    own_files.write(Path())
    Path("a.toml").write_text(OPEN_LOOP)
    counted(law="published").save("other.json")
    Path("damaged.json").write_text("{}")
    coverage(ran(BELT)).save("system.json")
    ran().save("run.npz")
    verb("cover", *words)


rows = {
    "other chart": lambda: counted() + counted(law="published"),
    "system and model": lambda: coverage([counted(), ran(BELT)]),
    "number for a run": lambda: coverage(3),
    "name for a run": lambda: coverage("pulled_mass"),
    "no runs": lambda: coverage([]),
    "number to add": lambda: counted() + 1,
    "sweep of a file": lambda: coverage(swept_and_saved()),
    "word for clauses": lambda: sweeping({"F_s": [1.5]}, coverage="all"),
    "unknown contact": lambda: counted().contact("gear"),
    "which of several contacts": lambda: coverage(ran(BELT)).contact(),
    "no file": lambda: Coverage.load("gone.json"),
    "folder for a file": lambda: Coverage.load("."),
    "into no folder": lambda: counted().save("gone/counts.json"),
}
group("coverage", called, rows)


KINDS: dict[str, Callable[[], object]] = {
    "run.npz": lambda: ran().save("run.npz"),
    "s.json": lambda: fig4(5.0).save("s.json"),
    "other.json": lambda: counted().save("other.json"),
    "swept.npz": swept_and_saved,
    "own.csv": lambda: Path("own.csv").write_text(GOOD),
    "own.toml": lambda: Path("own.toml").write_text(OPEN_LOOP),
}


def of_another_kind(load: Callable[[str], object], name: str) -> None:
    """Load a file of another kind."""
    KINDS[name]()
    load(name)


rows = {
    f"{load.__self__.__name__} of {name}": (load, name)  # type: ignore[attr-defined]
    for load in (Trace.load, Session.load, Sweep.load, Coverage.load)
    for name in KINDS
    if (load.__self__, name)  # type: ignore[attr-defined]
    not in ((Trace, "run.npz"), (Session, "s.json"), (Sweep, "swept.npz"), (Coverage, "other.json"))
}
group("file of another kind", of_another_kind, rows)
rows = {
    "counts of another chart": ("a.toml", "--merge", "other.json"),
    "counts of a system": ("a.toml", "--merge", "system.json"),
    "scenarios of two charts": ("a.toml", "servo"),
    "picture of several charts": ("pair.toml", "-o", "c.svg"),
    "missing contact": ("pair.toml", "-o", "c.svg", "--contact", "pad"),
    "contact of a model": ("a.toml", "-o", "c.svg", "--contact", "pad"),
    "missing contact, in words": ("pair.toml", "--contact", "pad"),
    "contact of a model, in words": ("a.toml", "--contact", "pad"),
    "override of a trace": ("run.npz", "--set", "run.t_end=1"),
    "sweep of a trace": ("run.npz", "--over", "F_s=1:2:2"),
    "grid that is none": ("a.toml", "--over", "F_s"),
    "ending of a picture": ("a.toml", "-o", "c.jpg"),
    "two charts at once": ("stiction", "servo", "--generate"),
    "motions into counts": ("stiction", "--generate", "--merge", "c.json"),
    "motions over a grid": ("stiction", "--generate", "--over", "F_s=1:2:2"),
    "seed of given runs": ("a.toml", "--seed", "1"),
    "bounds that are none": ("stiction", "--generate", "--bounds", "v"),
    "contact of a chart": ("stiction", "--generate", "--contact", "a"),
    "which contact to try": ("pair.toml", "--generate"),
}
group("cover", covering, rows)
rows = {
    "contact of a chart": lambda: generate(CHARTS["backlash"], "a"),
    "number for a chart": lambda: generate(3),
    "seed with a point": lambda: generate(CHARTS["backlash"], seed=0.5),
    "unknown bound": lambda: generate(CHARTS["backlash"], bounds={"q": (0, 1)}),
    "bound of one number": lambda: generate(CHARTS["backlash"], bounds={"v": 1}),
    "bounds the wrong way": lambda: generate(CHARTS["backlash"], bounds={"v": (1, 0)}),
}
group("generate", called, rows)
rows = {
    "damaged counts": ("a.toml", "--merge", "damaged.json"),
    "scenario that is missing": "gone.toml",
    "counts over the scenario": ("a.toml", "--merge", "a.toml"),
    "picture over the scenario": ("a.toml", "-o", "a.toml"),
    "counts into no folder": ("a.toml", "--merge", "gone/c.json"),
}
group("cover", covering, rows)


# --------------------------------------------------------------------------- cells and data sets
def cells(
    changes: Mapping[int, str], where: str = "", missing: str = "error", header: int | None = None
) -> None:
    """Read twenty rows of t, x [mm] and F, some of them changed; the header is row 1."""
    lines = ["t,x,F", *(f"{0.01 * i:.2f},{0.5 * i:.1f},{i % 7}" for i in range(20))]
    for number, text in changes.items():
        lines[number - 1] = text
    columns = {"time": "t", "position": ("x", "mm"), "force": "F"}
    read("\n".join(lines), where=where, missing=missing, header=header, **columns)


def sets(reader: Callable[[Any], Any], *last: str) -> None:
    """Read public data of a folder in which the last file is missing or damaged."""
    rows_ = "".join(f"{i},{i},{i},{i}\n" for i in range(9))
    for number in range(12):
        Path(f"test{number:02d}.csv").write_text("t_s,x_mm,v_mm_s,F_N\n" + rows_)
    for rest in last:
        Path("test12.csv").write_text("t_s,x_mm,v_mm_s,F_N\n" + rest)
    reader(".")


rows = {repr(unit): (unit,) for unit in ("", "MM", "m/min", "µ", "mm s")}
group("unit", lambda unit: factor("velocity", unit), rows)
HOLE = "time < 0.075 s or time > 0.085 s"
rows = {
    "word in a selected row": ({10: "0.08,lost,1"}, "time > 0.05 s"),
    "first of two words": {10: "0.08,1,off", 4: "0.02,x,1"},
    "word for a time": ({10: "late,1,1"}, "position > 0 mm"),
    "word for a force": ({10: "0.08,1,off"}, "not force > 3 N"),
    "time twice below a row left out": ({10: "0.08,lost,1", 15: "0.12,1,1"}, HOLE),
    "NaN below a row left out": ({10: "0.08,lost,1", 15: "0.13,1,nan"}, HOLE),
    "unit of another column": {2: "s,m,N"},
    "unit of the time": {2: "ms,mm,N"},
    "gap at an end": ({2: "0,,0"}, "", "interpolate"),
    "gap in time": ({7: ",1,1"}, "", "interpolate"),
    "header below the table": ({}, "", "error", 2000),
    "header that is a row": {2: "t,x,F"},
    "no header": {1: "note"},
}
group("cell of a record", cells, rows)
rows = {repr(each): (each,) for each in (None, [], {}, "rig.csv", 5, {1, 2})}
group("no data frame", Record.from_dataframe, rows)


class Frame(dict[str, list[Any]]):
    """A data frame without pandas."""

    columns = property(list)


CELLS = {"t_s": [*range(6)], "x_mm": [*range(6)], "F_N": [*range(6)]}
FRAME, TAKEN = Frame(CELLS), arrays()
SEVERAL = {"sigma_0": [1.0, 2.0], "F_c": 1.0}
rows = {
    "line of units": Frame(CELLS | {"t_s": ["[s]", *"12345"]}),
    "decimal commas": Frame(CELLS | {"x_mm": ["0,5", *"12345"]}),
    "word": Frame(CELLS | {"F_N": [*range(5), "off"]}),
}
group("data frame", Record.from_dataframe, rows)
rows = {"masked entry": {"force": np.ma.masked_array(F, mask=T == 2.0)}}
group("Record.from_arrays", lambda given: arrays(**given), rows)
rows = {
    "damper in no folder": lambda: damper("gone"),
    "tribometer in no folder": lambda: tribometer("gone"),
    "damper without files": lambda: damper("."),
    "tribometer without files": lambda: tribometer("."),
    "damper without its last file": lambda: sets(damper),
    "damper with a damaged file": lambda: sets(damper, "0,0,0,a\n" * 9),
}
group("public data", called, rows)

rows = {
    "list for a bank of one": lambda: bank(k=4e5),
    "column for a list": lambda: bank(k=np.array([[40.0], [10.0]])),
    "number with its unit": lambda: Slider("1 kg", "t"),
    "number with a decimal comma": lambda: Slider("0,5", "t"),
    "times for the end": lambda: simulate(GIVEN, MOVING, (0, 1)),
    "name of a scenario": lambda: simulate("servo", 1.0),
    "name of a chart": lambda: prove("lugre"),
    "threads by their number": lambda: sweep(GIVEN, MOVING, 1.0, {"v_c": [1e-6]}, executor=4),
    "folder for the format": lambda: export(GIVEN, "out", "c99"),
    "parameter of a contact": lambda: sweep(DRIVEN, 1.0, {"v_s": [1e-3]}),
    "frame for a record": lambda: fit(FRAME, GIVEN, free=["k"]),
    "frame for a model": lambda: fit(TAKEN, FRAME, free=["k"]),
    "frame for the rig": lambda: simulate(GIVEN, FRAME, 1.0),
    "model and record swapped": lambda: fit(GIVEN, TAKEN, free=["k"]),
    "model to choose from": lambda: choose(GIVEN),
    "record for a rig": lambda: simulate(GIVEN, TAKEN, 1.0),
    "class for a model": lambda: simulate(GMS, MOVING, 1.0),
    "rig for the end": lambda: simulate(GIVEN, 1.0, MOVING),
    "values for the end": lambda: sweep(GIVEN, MOVING, {"k": [1.0]}, 1.0),
    "frame for a file": lambda: Record.from_csv(FRAME, time="t"),
    "parameter for a chart's values": lambda: ChartModel(k=[1.0, 2.0]),
    "lists without their number": lambda: ChartModel(CHARTS["dahl"], SEVERAL),
}
group("call that is meant otherwise", called, rows)
rows = {
    "motion for its velocity": lambda: Prescribed(arrays().motion()),
    "decimal comma": lambda: Prescribed("0,001*sin(t)"),
}
group("signal that is meant otherwise", called, rows)
rows = {"date for a time": {3: "2024-01-01 00:00:01,1,1"}}
group("cell that is meant otherwise", cells, rows)
rows = {"folder": "."}
group("checkpoint", lambda path: simulate(GIVEN, MOVING, 1.0, checkpoint=path), rows)
rows = {"scenario": OPEN_LOOP.encode()}
group("file that is another", chart_bytes, rows)


def wrong_place(*words: str) -> None:
    """Call ``gms-fsm`` beside a scenario and a run."""
    Path("in").mkdir()
    Path("in/a.toml").write_text(OPEN_LOOP)
    ran().save("run.npz")
    verb(*words)


rows = {
    "folder for a scenario": ("run", "in"),
    "picture for the folder of pictures": ("plot", "run.npz", "-o", "one.png"),
    "file for the folder of a run": ("run", "in/a.toml", "-o", "a.csv"),
}
group("wrong place", wrong_place, rows)


if __name__ == "__main__":
    APPROVED.write_text(transcript(), encoding="utf-8")
