"""Public records of friction, read from a folder of the user's; none is part of the package."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

from gms_fsm.errors import RecordError
from gms_fsm.foundation.arguments import checked_path
from gms_fsm.records.record import Record

__all__ = ["damper", "tribometer"]

DAMPER_TESTS = tuple(f"test{number:02d}" for number in range(13))
DAMPER_LICENCE = (
    'CC BY-SA 4.0; D. Coble et al., ARTS-Laboratory, "Dataset-Friction-Damper-with-Backlash" (2022)'
)
DAMPER_SOURCE = (
    'get "Dataset-Friction-Damper-with-Backlash" by ARTS-Laboratory (github.com/ARTS-Laboratory, '
    "CC BY-SA 4.0), and save its 13 harmonic tests as test00.csv to test12.csv with the columns "
    "t_s, x_mm, v_mm_s, F_N"
)
TRIBOMETER_FILE = "reciprocating_friction.tsv"
TRIBOMETER_LICENCE = "MIT; J. Christopherson, FrictionModels.jl, examples/test_data_2.txt"
TRIBOMETER_SOURCE = (
    "get examples/test_data_2.txt of github.com/jchristopherson/FrictionModels.jl (MIT), and save "
    f"it as {TRIBOMETER_FILE} with the columns Time [s], Normal [uN], Position [mm], Friction [uN]"
)


def damper(folder: str | os.PathLike[str]) -> list[Record]:
    """Read the harmonic tests of a banded rotary friction damper with backlash.

    Parameters
    ----------
    folder : str or Path
        With ``test00.csv`` to ``test12.csv``, columns ``t_s, x_mm, v_mm_s, F_N``.

    Returns
    -------
    list of Record
        Thirteen, named ``test00`` to ``test12``, with position, measured velocity and force. The
        licence is in ``.licence`` and in the notes.

    Raises
    ------
    RecordError
        If the folder or a file is missing, with where to get the data; or if a file is damaged.
    """
    return [
        _read(
            folder,
            f"{test}.csv",
            DAMPER_LICENCE,
            DAMPER_SOURCE,
            velocity=("v_mm_s", "mm/s"),
        )
        for test in DAMPER_TESTS
    ]


def tribometer(folder: str | os.PathLike[str]) -> Record:
    """Read the record of a reciprocating tribometer: 50 cycles of 4 s at 5 N.

    Parameters
    ----------
    folder : str or Path
        With ``reciprocating_friction.tsv``.

    Returns
    -------
    Record
        Its rows with a normal force above 4.5 N; the force is reversed, so that it opposes the
        motion. The licence is in ``.licence`` and in the notes.

    Raises
    ------
    RecordError
        If the folder or the file is missing, with where to get the data; or if it is damaged.
    """
    return _read(
        folder,
        TRIBOMETER_FILE,
        TRIBOMETER_LICENCE,
        TRIBOMETER_SOURCE,
        time="Time [s]",
        position=("Position [mm]", "mm"),
        force=("Friction [uN]", "uN", -1),
        normal=("Normal [uN]", "uN"),
        where="normal > 4.5 N",
        name="tribometer",
    )


def _read(
    folder: str | os.PathLike[str], file: str, licence: str, source: str, **given: Any
) -> Record:
    path = Path(checked_path("folder", folder)) / file
    if not path.is_file():
        missing = f"there is no {file}" if path.parent.is_dir() else "there is no such folder"
        raise RecordError(missing, place=str(path.parent), advice=source)
    record = Record.from_csv(path, **given)
    return replace(record, licence=licence, notes=(f"licence: {licence}", *record.notes))
