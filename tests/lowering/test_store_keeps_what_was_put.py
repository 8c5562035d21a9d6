"""A store returns exactly what was put into it, or nothing, even with several users at once.

What has not been used for longest is removed where all files together would be too large.

Every wrong bit is detected, in name, checksum and content. Damaged files are removed, so that they
are recreated. The store does not interpret its contents.
"""

from __future__ import annotations

import os
import random
import threading
from pathlib import Path

import pytest

from gms_fsm.foundation.store import CodeFolder

CONTENT = random.Random(1).randbytes(300)


@pytest.fixture
def store(tmp_path: Path) -> CodeFolder:
    made = CodeFolder.at(tmp_path / "new" / "folder")
    assert made is not None
    return made


@pytest.mark.slow
def test_every_single_bit_is_checked(store: CodeFolder) -> None:
    store.put("one", CONTENT)
    path = store.folder / "one"
    whole = path.read_bytes()
    for bit in range(8 * len(whole)):
        changed = bytearray(whole)
        changed[bit // 8] ^= 1 << bit % 8
        path.write_bytes(changed)
        assert store.get("one") is None
        assert not path.exists()
    store.put("one", CONTENT)
    assert store.get("one") == CONTENT


@pytest.mark.parametrize("length", [0, 1, 31, 32, 33, 331])
def test_a_truncated_file_is_refused(store: CodeFolder, length: int) -> None:
    store.put("one", CONTENT)
    path = store.folder / "one"
    path.write_bytes(path.read_bytes()[:length])
    assert store.get("one") is None


def test_empty_content_can_be_stored(store: CodeFolder) -> None:
    assert store.get("none") is None
    store.put("none", b"")
    assert store.get("none") == b""


def test_a_file_cannot_replace_another(store: CodeFolder) -> None:
    store.put("one", CONTENT)
    (store.folder / "one").rename(store.folder / "two")
    assert store.get("two") is None


def test_on_a_full_disk_nothing_is_stored_or_raised(
    store: CodeFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", full)
    store.put("one", CONTENT)
    assert store.get("one") is None
    assert list(store.folder.iterdir()) == []


@pytest.mark.slow
def test_concurrent_readers_see_only_complete_content(store: CodeFolder) -> None:
    contents = [bytes([number]) * 100_000 for number in range(3)]
    store.put("one", contents[0])
    wrong: list[int] = []

    def write(content: bytes) -> None:
        for _ in range(100):
            store.put("one", content)
            if store.get("one") not in contents:
                wrong.append(1)

    threads = [threading.Thread(target=write, args=(content,)) for content in contents]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []
    assert [path.name for path in store.folder.iterdir()] == ["one"]


# --------------------------------------------------------------------------- its size
def test_what_has_not_been_used_for_longest_makes_room(tmp_path: Path) -> None:
    store = CodeFolder(tmp_path, most=1000)  # three files of 332 bytes
    for age, name in enumerate(("old", "older", "oldest")):
        store.put(name, CONTENT)
        os.utime(tmp_path / name, (1000 - age, 1000 - age))
    assert store.get("oldest") == CONTENT  # and is the one that was used last
    store.put("new", CONTENT)
    assert {path.name for path in tmp_path.iterdir()} == {"old", "oldest", "new"}
    store.put("large", CONTENT * 4)  # alone too large: it stays until the next one
    assert [path.name for path in tmp_path.iterdir()] == ["large"]


@pytest.mark.slow
def test_users_at_once_keep_the_size_and_read_whole_files(tmp_path: Path) -> None:
    contents = {str(k): bytes([k]) * 10_000 for k in range(20)}
    wrong: list[str] = []

    def use(seed: int) -> None:
        store = CodeFolder(tmp_path, most=100_000)
        for name in random.Random(seed).choices(list(contents), k=200):
            store.put(name, contents[name])
            if store.get(name) not in (contents[name], None):
                wrong.append(name)

    threads = [threading.Thread(target=use, args=(seed,)) for seed in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    CodeFolder(tmp_path, most=100_000).put("0", contents["0"])
    assert wrong == []
    assert 0 < sum(path.stat().st_size for path in tmp_path.iterdir()) <= 100_000
