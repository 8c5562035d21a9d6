"""`integrators` and `plots` are installed next to `gms_fsm`; a user's file may shadow them."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

__all__ = ["check_neighbours"]


def check_neighbours() -> None:
    """Refuse to start if another file or folder shadows one of our packages."""
    home = Path(__file__).resolve().parents[1]
    for name in ("integrators", "plots"):
        spec = find_spec(name)
        if spec is None:
            continue
        # A folder without __init__.py has no origin.
        place = next(filter(None, [spec.origin, *(spec.submodule_search_locations or [])]), "")
        resolved = Path(place).resolve()
        if place and home / name not in (resolved, *resolved.parents):
            raise ImportError(
                f"{place} hides the package {name!r} of gms-fsm; rename that file or "
                "folder, or run Python from another folder"
            )


check_neighbours()
