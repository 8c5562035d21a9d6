"""Run the cases with gms-fsm (all engines), SciPy and PathSim, and write the table of the docs.

    python benchmarks/conformance/run.py [--only CASE] [--tools gms-fsm scipy pathsim] [--write]

What is right stands in the JSON file next to each system file.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from gms_fsm import (
    GMSError,
    LivelockError,
    ParameterError,
    StepLimitError,
    System,
    Trace,
    simulate,
)

HERE = Path(__file__).parent
CASES = HERE / "cases"
ROOT = HERE.parents[1]
PAGE = ROOT / "docs" / "conformance.md"
LONGEST = 140  # characters of an answer in the table
BEGIN = "<!-- table: begin; made by `python benchmarks/conformance/run.py --write` -->\n"
END = "<!-- table: end -->"
ENGINES = ("compiled", "ifelse", "machines")
TOOLS = ("gms-fsm", "scipy", "pathsim")
TITLES = {"gms-fsm": "gms-fsm", "scipy": "SciPy", "pathsim": "PathSim"}
RTOL, MOST_STEPS = 1e-9, 20_000
# Reasons for a refusal: the error, and a part of what it says.
REASONS: dict[str, tuple[type[GMSError], str]] = {
    "driven": (ParameterError, "only driven bodies move it"),
    "livelock": (LivelockError, "hold together"),
    "not unique": (GMSError, "unique"),
    "zeno": (LivelockError, "shrink"),
}
Switch = tuple[float, str, int, str]


@dataclass(frozen=True)
class Outcome:
    """What a tool found: switches and end states; else why it did not."""

    switches: list[Switch]
    end: dict[str, float]
    refused: str = ""
    ended: bool = True


def names() -> list[str]:
    """Return the names of all cases."""
    return sorted(path.stem for path in CASES.glob("*.json"))


def expected(name: str) -> dict[str, Any]:
    """Return what is right for a case."""
    found: dict[str, Any] = json.loads((CASES / f"{name}.json").read_text(encoding="utf-8"))
    return found


# --------------------------------------------------------------------------- gms-fsm
def traced(name: str, right: dict[str, Any], engine: str) -> Trace:
    """Run a case with one engine."""
    system = System.load(str(CASES / f"{name}.toml"))
    how: dict[str, Any] = {"engine": engine, "rtol": RTOL, "max_steps": MOST_STEPS}
    return simulate(system, right["t_end"], initial=right["initial"], **how)


def outcome(name: str, right: dict[str, Any], engine: str) -> tuple[Outcome, str]:
    """Run a case with one engine; return what it found and where the momentum was lost."""
    try:
        trace = traced(name, right, engine)
    except StepLimitError:
        return Outcome([], {}, ended=False), ""
    except GMSError as error:
        return Outcome([], {}, f"{type(error).__name__}: {error}"), ""
    log = trace.transitions
    # An empty log has no columns.
    rows = zip(log.t, log.contact, log.element, log.edge, strict=True) if len(log) else ()
    switches = [(float(t), str(contact), int(i) + 1, str(edge)) for t, contact, i, edge in rows]
    return Outcome(switches, {key: value(trace, key) for key in right.get("end", {})}), lost(
        trace, right.get("mass", {})
    )


def value(trace: Trace, key: str) -> float:
    """Return an end state by its name: ``body.x``, ``contact.F``, ``contact.z_2``, ``I``."""
    owner, _, name = key.rpartition(".")
    if not owner:
        return float(trace.value(name)[-1])
    if name in ("x", "v"):
        return float(getattr(trace.body(owner), name)[-1])
    if name == "F":
        return float(trace.contact(owner).F[-1])
    variable, _, element = name.partition("_")
    return float(trace.contact(owner).variable(variable)[-1, int(element or 1) - 1])


def lost(trace: Trace, mass: dict[str, float]) -> str:
    """Say where the momentum of bodies changes, though it should not."""
    if not mass:
        return ""
    total = sum(m * trace.body(body).v for body, m in mass.items())
    change = float(np.ptp(np.asarray(total)))
    return f"momentum changes by {change:.1e}" if change > 1e-12 else ""


def same_bits(name: str, right: dict[str, Any], one: str, other: str) -> bool:
    """Return whether two engines give the same rows and the same log."""
    a, b = (traced(name, right, engine) for engine in (one, other))
    mine, theirs = a.columns(), b.columns()
    return a.transitions_csv() == b.transitions_csv() and all(
        np.array_equal(mine[column], theirs[column], equal_nan=mine[column].dtype.kind == "f")
        for column in mine | theirs
    )


# --------------------------------------------------------------------------- verdicts
def verdict(right: dict[str, Any], found: Outcome) -> str:
    """Compare with what is right: ``right``, ``wrong: ...``, ``refused: ...`` or ``endless``."""
    wanted = right.get("refused")
    if not found.ended:
        return "endless"
    if found.refused:
        if wanted is None:
            return f"refused: {found.refused}"
        error, part = REASONS[wanted]
        known = found.refused.startswith(_kinds(error)) and part in found.refused
        return "right" if known else f"refused for another reason: {found.refused}"
    if wanted is not None:
        return f"wrong: gives an answer, {_counted(found.switches)}"
    return _differs(right, found) or "right"


def _kinds(error: type[GMSError]) -> tuple[str, ...]:
    """Return the names of an error and of those derived from it."""
    return (error.__name__, *(name for each in error.__subclasses__() for name in _kinds(each)))


def _counted(switches: Sequence[object]) -> str:
    return f"{len(switches)} switch{'' if len(switches) == 1 else 'es'}"


def _differs(right: dict[str, Any], found: Outcome) -> str:
    near = right["tolerance"]
    if right["switches"] is not None:
        wanted = [(e["t"], e["contact"], e["element"], e["edge"]) for e in right["switches"]]
        for i, (one, other) in enumerate(zip(wanted, found.switches, strict=False)):
            if one[1:] != other[1:]:
                return f"wrong: switch {i + 1} is {_told(other)} instead of {_told(one)}"
            if abs(one[0] - other[0]) > near["t"]:
                return f"wrong: {_told(other)} instead of {one[0]:.9g} s"
        if len(wanted) != len(found.switches):
            return f"wrong: {_counted(found.switches)} instead of {len(wanted)}"
    for key, u in right["end"].items():
        if key in found.end and not abs(found.end[key] - u) <= near["end"] * max(1.0, abs(u)):
            return f"wrong: {key} is {found.end[key]:.9g} instead of {u:.9g}"
    return ""


def _told(switch: Switch) -> str:
    t, contact, element, edge = switch
    number = f" {element}" if element > 1 else ""
    return f"{contact}{number} {edge} at {t:.9g} s"


def judged(name: str, tool: str) -> str:
    """Run a case with a tool and return its verdict."""
    right = expected(name)
    if tool == "gms-fsm":
        first, *others = (e for e in ENGINES if e != "compiled" or _compiles())
        found, momentum = outcome(name, right, first)
        answer = verdict(right, found)
        if answer == "right" and momentum:
            return f"wrong: {momentum}"
        if answer == "right" and not right.get("refused"):
            for engine in others:
                if not same_bits(name, right, first, engine):
                    return f"wrong: {first} and {engine} differ"
        return answer
    from benchmarks.conformance import rivals

    try:
        switches, end = rivals.TOOLS[tool](name)
    except rivals.Endless:
        return verdict(right, Outcome([], {}, ended=False))
    except rivals.Inexpressible as reason:
        return f"not expressed: {reason}"
    except Exception as error:  # whatever a tool raises is its answer
        return f"fails: {type(error).__name__}: {str(error)[:80]}"
    return verdict(right, Outcome(switches, end))


def _compiles() -> bool:
    return importlib.util.find_spec("llvmlite") is not None


# --------------------------------------------------------------------------- the table
def table(answers: dict[str, dict[str, str]], tools: list[str]) -> str:
    """Return the table as Markdown: a row for each case, and how many are right."""
    heads = ["case", "expected", *(TITLES[tool] for tool in tools)]
    lines = [f"| {' | '.join(heads)} |", "|" + "---|" * len(heads)]
    for name, row in answers.items():
        right = expected(name)
        switches = right.get("switches")
        number = "" if switches is None else f", {_counted(switches)}"
        said = f"no answer: {right['refused']}" if "refused" in right else f"an answer{number}"
        cells = [f"`{name}`: {right['title']}", said, *(_short(row[tool]) for tool in tools)]
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    totals = (sum(row[tool] == "right" for row in answers.values()) for tool in tools)
    lines.append(f"| right | {len(answers)} | " + " | ".join(map(str, totals)) + " |")
    return "\n".join(lines) + "\n"


def _short(answer: str) -> str:
    words = " ".join(answer.split())
    return words if len(words) <= LONGEST else f"{words[:LONGEST].rstrip()} ..."


def main() -> None:
    """Print the table, or write it into the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", choices=names(), default=names())
    parser.add_argument("--tools", nargs="+", choices=TOOLS, default=list(TOOLS))
    parser.add_argument("--write", action="store_true", help="write the table into the docs")
    given = parser.parse_args()
    if given.write and (given.only != names() or given.tools != list(TOOLS)):
        parser.error("--write takes all cases and all tools")
    sys.path.insert(0, str(ROOT))  # for the rivals
    answers: dict[str, dict[str, str]] = {}
    for name in given.only:
        answers[name] = {}
        for tool in given.tools:
            answers[name][tool] = judged(name, tool)
            print(f"{name}, {tool}: {answers[name][tool]}", flush=True)
    versions = ", ".join(
        f"{TITLES[tool]} {version(tool)}" for tool in given.tools if tool != "gms-fsm"
    )
    made = table(answers, given.tools) + (f"\n{versions}.\n" if versions else "")
    if given.write:
        before, rest = PAGE.read_text(encoding="utf-8").split(BEGIN)
        _, after = rest.split(END)
        PAGE.write_text(f"{before}{BEGIN}\n{made}\n{END}{after}", encoding="utf-8")
    else:
        print(made)


if __name__ == "__main__":
    main()
