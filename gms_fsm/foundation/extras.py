"""Optional packages: what each extra is for, and one message for all that are missing."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from gms_fsm.errors import MissingExtraError, why

# For each extra: the feature that needs it, and the alternative without it.
EXTRAS: Mapping[str, tuple[str, str]] = {
    "plots": ("figures and animations need", "runs, traces and charts need no extra"),
    "film": ("videos need", "a film can be written as a .gif"),
    "render": (
        "pictures of charts need",
        "Graphviz's program dot draws them too, and charts can be written as text",
    ),
    "pandas": ("data frames need", "Trace.columns() has the same numbers, and so has a CSV file"),
    "fast": ("engine 'compiled' needs", "engine='machines' gives the same result, slower"),
    "sweep": ("tables of a sweep need", "Sweep.save writes .npz files"),
    "replay": ("a replay page needs", "gms-fsm plot and gms-fsm debug show a run too"),
    "tui": (
        "the full-screen debugger needs",
        "gms-fsm debug without --tui answers at a prompt, and gms-fsm replay makes a page",
    ),
    "jupyter": ("the widget needs", "plots.replay shows a run in a notebook too"),
    "pathsim": ("the PathSim block needs", "FrictionState steps in any loop"),
    "control": ("the python-control system needs", "FrictionState steps in any loop"),
    "mujoco": ("joint friction in MuJoCo needs", "FrictionState steps in any loop"),
    "gymnasium": ("the environment needs", "FrictionState steps in any loop"),
    "check": ("checking a chart needs", "a chart runs without its proofs"),
}


def has_machine_code() -> bool:
    """Return whether engine 'compiled' can be used."""
    return all(map(find_spec, ("llvmlite", "platformdirs")))


def require(module: str, extra: str) -> Any:
    """Import an optional module, or say how to install it.

    Examples
    --------
    >>> require("math", "plots").tau > 6
    True
    >>> require("no_such_module", "pandas")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    gms_fsm.errors.MissingExtraError: data frames need no_such_module, which is not installed: ...
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        raise missing(error.name or module, extra) from None
    except ImportError as error:
        raise missing(module, extra, f"cannot be imported ({why(error)})") from error


def missing(name: str, extra: str, state: str = "is not installed") -> MissingExtraError:
    """Return an error that says what is missing, which extra provides it, and the alternative."""
    needed, without = EXTRAS[extra]
    return MissingExtraError(
        f'{needed} {name}, which {state}: pip install "gms-fsm[{extra}]" installs it '
        f"(without it: {without})"
    )
