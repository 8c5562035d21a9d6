"""Claim: threads can read trace files and parse formulas at the same time.

Python 3.11 counts the depth of ``ast.parse`` for all threads together, so one thread could make
another fail (SystemError) when the garbage collector switched threads. Here it always does.
"""

from __future__ import annotations

import gc
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from gms_fsm.language import parse_value
from gms_fsm.traces.files.archives import member


@pytest.mark.slow
def test_four_threads_read_files_and_formulas(tmp_path: Path) -> None:
    path = tmp_path / "arrays.npz"
    np.savez(path, **{f"a{i}": np.zeros((3, 4)) for i in range(5)})
    wrong: list[BaseException] = []
    done = [0, 0]

    def give_way(_phase: str, _info: dict[str, int]) -> None:
        time.sleep(0.0)

    def read(end: float) -> None:
        while time.monotonic() < end and not wrong:
            try:
                with np.load(path) as file:
                    done[0] += sum(member(file, f"a{i}").shape == (3, 4) for i in range(5))
            except BaseException as error:
                wrong.append(error)

    def think(end: float) -> None:
        while time.monotonic() < end and not wrong:
            try:
                parse_value("a * (x + sin(2.0 * y)) - min(x, y)", {"a", "x", "y"})
                done[1] += 1
            except BaseException as error:
                wrong.append(error)

    before = gc.get_threshold()
    gc.callbacks.append(give_way)
    gc.set_threshold(5)
    try:
        end = time.monotonic() + 1.0
        threads = [threading.Thread(target=work, args=(end,)) for work in (read, think) * 2]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        gc.callbacks.remove(give_way)
        gc.set_threshold(*before)
    assert wrong == []
    assert min(done) > 0
