"""Check that two commits compute the same numbers, by comparing the same runs at both.

    python benchmarks/same_bits.py OLD [NEW] [--quick]

OLD and NEW are commits; NEW defaults to the working tree. Traces, transition logs, states,
sweeps and sessions are compared to the last bit, by sha256, array by array. The exit code is 1 if
anything differs, fails, or exists at only one of the two. Machine code is compiled anew for both
(extra ``fast``). The scenario with a measured record runs only if GMS_FSM_DATA names its folder.
No hashes are kept in the repository: another machine, numpy or scipy may give other last bits.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import BDF, Radau

import gms_fsm as fsm  # only its public names: modules may move between commits

ROOT = Path(__file__).resolve().parents[1]
Parts = dict[str, str]  # name of an array -> sha256
Table = dict[str, Parts]  # name of a run -> its parts
FAILED = "failed"  # the only part of a run that failed, with the reason


def digest(values: ArrayLike) -> str:
    """Return the sha256 of an array: its kind, its shape, its bits."""
    array = np.asarray(values)
    text = array.dtype.kind == "U"
    content = "\0".join(array.ravel().tolist()).encode() if text else array.tobytes()
    kind = "text" if text else array.dtype.str
    return hashlib.sha256(f"{kind} {array.shape} ".encode() + content).hexdigest()


def _records(name: str, records: Any) -> Parts:
    return {f"{name}.{field}": digest(records[field]) for field in records.dtype.names}


def _trace(trace: fsm.Trace) -> Parts:
    parts = {name: digest(column) for name, column in trace.columns().items()}
    return parts | _records("log", trace.transitions) | _records("sliding", trace.sliding)


def _run(model: Any, rig: Any, t_end: float, **options: Any) -> Parts:
    try:
        return _trace(fsm.simulate(model, rig, t_end, **options))
    except fsm.SimulationError as error:  # compare the part before the error
        parts = {} if error.trace is None else _trace(error.trace)
        return {"error": digest(type(error).__name__)} | parts


def _sweep(engine: str, **options: Any) -> Parts:
    varied = {"k": [[40.0, 30.0, 20.0, 10.0], [30.0, 30.0, 30.0, 5.0]], "speed": [0.1, 0.2]}
    with ThreadPoolExecutor(1) as executor:
        options |= {"engine": engine, "executor": executor, "progress": False}
        found = fsm.sweep(_bank("signed", 4, 0.05), PULLED, 20.0, varied, **options)
    ends = {name: getattr(found, name) for name in ("t", "x", "v", "F", "z", "outcome", "states")}
    parts = {name: digest(array) for name, array in ends.items()}
    parts |= {f"rows.{name}": digest(array) for name, array in found.rows.items()}
    return parts | _records("log", found.transitions)


def _session(model: Any, rig: Any, t: float, v: float | None, **options: Any) -> Parts:
    session = fsm.Session(model, rig, 2 * t, **options)
    places = [session.step(5), session.next_transition(), session.step(3), session.back(2)]
    places += [session.goto(t), session.prev_transition(), session.goto(t)]
    session.poke({"z": {0: 0.5 * session.here.z[0]}}, v=v)
    places += [session.here, session.step(4), session.back(1), session.next_transition()]
    session.compare()  # runs both branches to their ends
    seen = ("row", "t", "microstep", "x", "v", "F", "z", "s", "F_elements", "states")
    parts = {name: digest([np.ravel(getattr(here, name)) for here in places]) for name in seen}
    for number in range(2):
        session.switch(number)
        branch = _trace(session.branch.trace())
        parts |= {f"branch {number} {name}": sha for name, sha in branch.items()}
    return parts


def _scenario(scenario: Path) -> Parts:
    with tempfile.TemporaryDirectory() as folder:
        module = "gms_fsm.cli" if find_spec("gms_fsm.cli") else "gms_fsm.app.cli"
        code = f"from {module} import main; main()"
        command = [sys.executable, "-c", code, "run", str(scenario), "-o", folder]
        done = subprocess.run([*command, "--set", "output.figures=[]"], capture_output=True)
        if done.returncode != 0:
            raise RuntimeError(f"exit code {done.returncode}: {done.stderr.decode()[-300:]}")
        return _trace(fsm.Trace.load(Path(folder) / "trace.npz"))


def _bank(law: Any, n: int, v_s: float = 0.02) -> fsm.GMS:
    k, curve = np.linspace(40.0, 10.0, n), fsm.Stribeck(F_c=1.0, F_s=1.5, v_s=v_s)
    own: dict[str, Any] = {"alpha": np.full(n, 1 / n), "k": k, "C": 2.0, "sigma": 0.01 * k}
    return fsm.GMS(fsm.GMSParameters.from_shares(stribeck=curve, v_c=1e-6, **own), law=law)


# fmt: off
def _creeping() -> fsm.ChartModel:
    chart = fsm.Chart("creeping", ("v", "s", "t"), ("z", "w"), ("k", "C", "v_c"),
        (fsm.State("stick", {"z": "v", "w": "0"}, entry={"z": "0.5*z"}),
         fsm.State("creep", {"z": "v*(1 - 0.5*abs(z)/s)", "w": "0"}),
         fsm.State("slip", {"z": "C*(sgn(v) - z/s)", "w": "abs(v)"}, exit={"w": "w + 1"})),
        (fsm.Transition("yield_", "stick", "creep", "abs(z) >= 0.6*s"),
         fsm.Transition("tear", "creep", "slip", "abs(z) >= s and (v > v_c or v < -v_c)"),
         fsm.Transition("heal", "creep", "stick", "not abs(z) >= 0.3*s"),
         fsm.Transition("arrest", "slip", "stick", "abs(v) <= v_c", actions={"z": "0.8*z"})),
        {"F": "k*z + 0.1*dz"})
    own: dict[str, Any] = {"values": {"k": np.array([1.0, 2.0]), "C": 0.3, "v_c": 1e-6}}
    return fsm.ChartModel(chart, n=2, stribeck=CURVE, weights=np.array([0.5, 1.0]), **own)


CURVE = fsm.Stribeck(F_c=1.0, F_s=1.5, v_s=0.02)
PULLED = fsm.PulledSlider(1.0, 2.0, 0.1)


def runs() -> dict[str, Callable[[], Parts]]:
    """Return all runs by name; those whose name ends in * make up ``--quick``."""
    found: dict[str, Callable[[], Parts]] = {}
    for path in sorted(Path().glob("**/scenarios/*.toml")):
        if "\n[record]" in path.read_text(encoding="utf-8") and not os.environ.get("GMS_FSM_DATA"):
            print(f"{path.name} is skipped: GMS_FSM_DATA is not set", file=sys.stderr)
        else:
            quick = " *" * path.stem.startswith("paper")
            found[f"scenario {path.stem}{quick}"] = partial(_scenario, path)
    def add(name: str, model: Any, rig: Any, t_end: float, **options: Any) -> None:
        found[name] = partial(_run, model, rig, t_end, **options)
    on, force = fsm.State("on", {"z": "v"}), {"F": "0.4*sgn(v)"}
    coulomb = fsm.ChartModel(fsm.Chart("Coulomb", ("v",), ("z",), (), (on,), (), force), {})
    table_1 = fsm.GMSParameters.paper("stick-slip")
    published, signed = fsm.GMS(table_1, law="published"), fsm.GMS(table_1, law="signed")
    mass, creeping, fixed = _bank("signed", 4, 0.05), _creeping(), {"step": 0.01}
    lugre = fsm.LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=0.4, stribeck=CURVE)
    moved, Slider = fsm.Prescribed, fsm.Slider
    sine, faster = moved("0.2*sin(2*pi*t/20)"), moved("0.3*sin(2*pi*t/17)")
    record = moved((np.linspace(0, 15, 301), 0.1 * np.sin(np.linspace(0, 12, 301))))
    function = moved(lambda t: 0.01 * t * np.sin(t))
    ramps = moved([(0.0, 0.0), (1.0, 0.1), (4.0, 0.1), (6.0, -0.1), (9.0, -0.1), (15.0, 0.1)])
    for engine in ("machines", "ifelse", "compiled"):
        add(f"GMS published, sine, {engine} *", published, sine, 31.0, engine=engine)
        add(f"GMS signed, sine, {engine}", signed, sine, 31.0, engine=engine)
        add(f"GMS signed, heun, {engine}", signed, sine, 9.0, method="heun", engine=engine, **fixed)
        add(f"GMS signed, pulled, {engine}", mass, PULLED, 30.0, engine=engine)
        add(f"own chart, sine, {engine}", creeping, faster, 20.0, engine=engine)
        add(f"LuGre, pushed, {engine}", lugre, Slider(1.0, "0.3*t"), 6.0, engine=engine)
        found[f"sweep, {engine}"] = partial(_sweep, engine)
    add("GMS signed, sine, bs23", signed, sine, 31.0, method="bs23")
    add("GMS signed, pulled, rk4 *", mass, PULLED, 20.0, method="rk4", step=2e-3)
    add("GMS signed, sine, Radau *", signed, sine, 31.0, method=Radau)
    add("LuGre, sine, BDF, led by steps", lugre, moved("0.01*sin(t)"), 3.0, method=BDF, **fixed)
    add("GMS signed, events by step *", signed, sine, 31.0, method="rk4", events="step", **fixed)
    add("GMS signed, 1 element, ramps *", _bank("signed", 1), ramps, 15.0)
    add("GMS published, 2 elements, ramps", _bank("published", 2), ramps, 15.0)
    add("GMS signed, 7 elements, record", _bank("signed", 7), record, 15.0)
    add("GMS signed, 12 elements, function", _bank("signed", 12), function, 15.0)
    add("GMS published, free slider *", _bank("published", 3), Slider(0.5, "2*sin(t)"), 3.0)
    free, pulse = _bank("signed", 3), Slider(0.5, "2*max(0, 1 - abs(t - 2))")
    add("GMS signed, free slider, thrown", free, pulse, 8.0, initial={"v": 0.5, "z": [0.1, 0, 0]})
    add("GMS signed, loose tolerances", mass, PULLED, 20.0, rtol=1e-4, atol={"z": 1e-6})
    add("GMS signed, wanted times", mass, PULLED, 20.0, t_eval=np.linspace(0, 20, 501))
    add("GMS signed, the end only", mass, PULLED, 20.0, output="end", engine="compiled")
    add("own chart, pulled *", creeping, PULLED, 10.0)
    add("Coulomb, slides on v = 0 *", coulomb, Slider(1.0, "0.6*sin(t)"), 12.0)
    add("a run that stops early", signed, sine, 31.0, max_steps=100)
    found["sweep, wanted times *"] = partial(_sweep, "ifelse", output="t_eval", t_eval=range(21))
    found["session, sine *"] = partial(_session, signed, sine, 12.0, None)
    found["session, pulled, ifelse"] = partial(_session, mass, PULLED, 10.0, 0.05, engine="ifelse")
    found["session, own chart"] = partial(_session, creeping, faster, 9.0, None, method="bs23")
    return found
# fmt: on


def child(output: Path, quick: bool) -> None:
    """Run everything with the packages of the current folder; write the digests."""
    if not Path(fsm.__file__).resolve().is_relative_to(Path.cwd().resolve()):
        raise SystemExit(f"gms_fsm was imported from {fsm.__file__}, not from {Path.cwd()}")
    table: Table = {}
    for name, run in runs().items():
        if name.endswith("*") or not quick:
            try:
                table[name] = run()
            except Exception as error:  # of any kind: the other runs continue
                table[name] = {FAILED: f"{type(error).__name__}: {error}"}
    output.write_text(json.dumps(table), encoding="utf-8")


def table_at(commit: str | None, quick: bool) -> Table:
    """Return the digests at a commit; None is the working tree."""
    with tempfile.TemporaryDirectory() as folder:
        root, output = ROOT, Path(folder) / "digests.json"
        if commit is not None:
            root = Path(folder) / "tree"
            archive = f"{root}.zip"
            subprocess.run(["git", "archive", "-o", archive, commit], cwd=ROOT, check=True)
            shutil.unpack_archive(archive, root)
        own = os.environ | {"PYTHONPATH": str(root), "GMS_FSM_CACHE": str(Path(folder) / "code")}
        command = [sys.executable, __file__, "--child", str(output), *["--quick"] * quick]
        subprocess.run(command, cwd=root, env=own, check=True)
        return dict(json.loads(output.read_text(encoding="utf-8")))


def compared(old: Table, new: Table) -> tuple[list[str], int]:
    """Return a line for each run, and the number of runs that are not the same."""
    lines, others = [], 0
    for name in sorted(old | new):
        parts, said = (old.get(name, {}), new.get(name, {})), "same"
        differ = [part for part in parts[0] | parts[1] if parts[0].get(part) != parts[1].get(part)]
        if name not in old or name not in new:
            said = f"MISSING at {'OLD' if name not in old else 'NEW'}"
        elif failures := [p[FAILED] for p in parts if FAILED in p]:
            said = f"FAILED: {'; '.join(failures)}"
        elif differ:
            said = f"DIFFERS in {', '.join(differ[:6])}{', ...' if len(differ) > 6 else ''}"
        others += said != "same"
        short = [digest(json.dumps(p, sort_keys=True))[:10] if p else "-" for p in parts]
        lines.append(f"{name:<38} {short[0]:<10} {short[1]:<10} {said}")
    return lines, others


def main() -> int:
    """Compare two commits; return the exit code."""
    parser = argparse.ArgumentParser(description="The same runs at two commits, to the last bit.")
    parser.add_argument("old", metavar="OLD", help="a commit")
    parser.add_argument("new", metavar="NEW", nargs="?", help="a commit; default: the working tree")
    parser.add_argument("--quick", action="store_true", help="about a dozen runs")
    given = parser.parse_args()
    lines, others = compared(table_at(given.old, given.quick), table_at(given.new, given.quick))
    print(*lines, f"{len(lines)} runs, {len(lines) - others} the same", sep="\n")
    return 1 if others or not lines else 0


if __name__ == "__main__":
    if "--child" in sys.argv:
        child(Path(sys.argv[2]), "--quick" in sys.argv)
    else:
        sys.exit(main())
