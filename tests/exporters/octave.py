"""Running exported function files in GNU Octave."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.targets.matlab import matlab

OCTAVE = shutil.which("octave-cli")
DRIVER = """\
file = fopen('lines.bin');
lines = fread(file, [{width}, Inf], 'double').';
fclose(file);
s = friction();
s.longest_step = {step};
forces = zeros(rows(lines), 1);
for k = 1:rows(lines)
    one = num2cell(lines(k, :));
    [s, forces(k)] = friction(s, one{{:}});
end
file = fopen('found.bin', 'w');
fwrite(file, [numel(forces); forces; s.log.'(:)], 'double');
fclose(file);
"""


def ran_in_octave(
    folder: Path, model: Any, lines: np.ndarray, step: float
) -> tuple[np.ndarray, list[tuple[float, int, int]]]:
    """Return the forces at the ends of the lines, and time, element and edge of each switch.

    Parameters
    ----------
    folder : Path
        Where the files are written; created.
    model : Model or Contact
        The friction.
    lines : ndarray, shape (m, 3 + 2 * inputs)
        v0, v1, dt and further inputs of every call.
    step : float
        s: the longest step.
    """
    assert OCTAVE is not None
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in matlab(Subject.of(model, "matlab", name="friction")).items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "lines.bin").write_bytes(np.ascontiguousarray(lines, dtype=float).tobytes())
    driver = DRIVER.format(width=lines.shape[1], step=repr(step).title())
    (folder / "driver.m").write_text(driver, encoding="utf-8")
    command = [OCTAVE, "--norc", "--quiet", "driver.m"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert (folder / "found.bin").exists(), done.stdout + done.stderr
    found = np.fromfile(folder / "found.bin")
    count = int(found[0])
    log = found[1 + count :].reshape(-1, 3)
    return found[1 : 1 + count], [(t, int(i), int(edge)) for t, i, edge in log]


def lines_of(t: np.ndarray, v: np.ndarray, sample: float) -> np.ndarray:
    """Return a record as calls: v0, v1, dt between samples and corners; two at one time: a jump."""
    parts = []
    for k in range(len(t) - 1):
        if t[k + 1] > t[k]:
            count = int(np.ceil((t[k + 1] - t[k]) / sample))
            times = np.linspace(t[k], t[k + 1], count + 1)
            values = np.linspace(v[k], v[k + 1], count + 1)
            parts.append(np.column_stack([values[:-1], values[1:], np.diff(times)]))
    return np.vstack(parts)
