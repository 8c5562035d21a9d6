"""Each format writes a run's friction and system, in the same bytes twice, or names what it cannot.

The files are whole, all in the folder given, with a README; our own are replaced. A refusal is one
error with a place, and nothing is written.
"""

from __future__ import annotations

import itertools
import shutil
from pathlib import Path
from typing import Any

import pytest

from gms_fsm import GMSError, Model, System, export
from gms_fsm.exporters import formats
from tests.corpus import run
from tests.helpers import matrix

pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore:the FMU has no binary"),
]
RUNS = ("open loop", "system servo")
NOT_OF_SYSTEMS = {"scxml", "transitions", "matlab", "modelica", "st"}  # not of one with locks
PAIRS = [*itertools.product(formats(), RUNS)]
SLOWER = {("fmu3", "open loop"), ("fmu2", "system servo"), ("js", "open loop")}


def subject_of(name: str) -> Model | System:
    subject: Model | System = run(name).subject[0]
    return subject


def there(folder: Path) -> dict[str, bytes]:
    """Return what is in a folder, beside the list of what is ours."""
    files = [each for each in folder.rglob("*.*") if each.name != ".gms-fsm-files.json"]
    return {each.relative_to(folder).as_posix(): each.read_bytes() for each in files}


@pytest.mark.every(2)
@pytest.mark.parametrize(("form", "name"), matrix(PAIRS, {*PAIRS} - SLOWER))
def test_it_is_written_or_refused(
    form: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shutil, "which", lambda _: None)  # archives without binaries are faster
    subject, folder = subject_of(name), tmp_path / "out"
    whole, program = isinstance(subject, System), formats()[form].subject == "friction"
    more: dict[str, Any] = {"t_end": 1.0} if form == "js" and whole else {}
    if whole and (form in NOT_OF_SYSTEMS or not program):
        with pytest.raises(GMSError, match="system") as caught:
            export(subject, form, folder, name="it")
        assert caught.value.place
        assert caught.value.reason
        assert not folder.exists()
        return
    files = export(subject, form, folder, name="it", **more)
    first = there(folder)
    assert set(first) == {path.name for path in files}
    assert all(first.values())
    assert (f"README-it-{form}.md" in first) == program
    assert export(subject, form, folder, name="it", **more) == files
    assert there(folder) == first
