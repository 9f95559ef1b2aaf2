"""Rows on disk: what a crash, a full disk or a flipped bit leaves behind is seen, set aside and written again."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.bench.kernel.store import RowStore, Scribe, StorageError, seal, sole_writer, unseal
from chauffeur.concept import ChauffeurError, ConfigError


def _fill(path: Path, count: int = 5) -> list[bytes]:
    with RowStore(path, "k") as store:
        for i in range(count):
            store.append({"k": f"r{i}", "v": i})
    return path.read_bytes().splitlines(keepends=True)


def test_rows_come_back_and_the_last_of_a_key_wins(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "rows.jsonl"
    with RowStore(path, "k") as store:
        store.append({"k": "a", "v": 1}, {"k": "b", "v": "Grüße \udc80"})
        store.append({"k": "a", "v": 2})
    again = RowStore(path, "k")
    assert again.rows == {"a": {"k": "a", "v": 2}, "b": {"k": "b", "v": "Grüße \udc80"}}
    assert again.damaged == []


@given(
    st.dictionaries(
        st.text(),
        st.recursive(
            st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(), st.lists, max_leaves=5
        ),
    )
)
def test_a_line_is_its_row(row: dict[str, object]) -> None:
    line = seal(row)
    assert line.endswith(b"\n") and line.count(b"\n") == 1
    assert unseal(line.rstrip(b"\n")) == row


def test_no_flipped_bit_goes_unseen() -> None:
    row = {"k": "sample_3", "score": 80.25, "success": True}
    line = seal(row).rstrip(b"\n")
    for place in range(len(line)):
        for bit in range(8):
            spoiled = bytearray(line)
            spoiled[place] ^= 1 << bit
            try:
                found = unseal(bytes(spoiled))
            except (ValueError, TypeError):
                continue
            # What is left is damage to the checksum's own frame: the row itself is whole.
            assert {name: found.get(name) for name in row} == row


def test_lines_without_a_checksum_are_taken_at_their_word(tmp_path: Path) -> None:
    path = tmp_path / "rows.jsonl"
    path.write_text('{"k": "a", "v": 1}\n')
    assert RowStore(path, "k").rows["a"]["v"] == 1


@pytest.mark.parametrize("cut", [1, 2, 9, 30])
def test_a_torn_end_is_dropped_and_the_file_goes_on(tmp_path: Path, cut: int) -> None:
    path = tmp_path / "rows.jsonl"
    _fill(path)
    path.write_bytes(path.read_bytes()[:-cut])
    with RowStore(path, "k") as store:
        assert set(store.rows) == {"r0", "r1", "r2", "r3"}
        assert store.damaged == [], "a torn end is what a crash leaves, not damage"
        store.append({"k": "r4", "v": 40})
    again = RowStore(path, "k")
    assert again.rows["r4"]["v"] == 40 and again.damaged == []
    assert not list(tmp_path.glob("*.damaged"))


@pytest.mark.parametrize(
    "spoiled", [b"not json\n", b"\0" * 40 + b"\n", b'["r2"]\n', b'{"v": 2}\n', b"\xff\xfe\n", b"\n"]
)
def test_damaged_lines_are_set_aside_and_done_again(tmp_path: Path, spoiled: bytes) -> None:
    path = tmp_path / "rows.jsonl"
    lines = _fill(path)
    lines[2] = spoiled
    path.write_bytes(b"".join(lines))
    store = RowStore(path, "k")
    assert set(store.rows) == {"r0", "r1", "r3", "r4"} and store.damaged == [3]
    assert path.read_bytes() == b"".join(lines), "reading alone changes nothing"
    store.append({"k": "r2", "v": 2})
    store.close()
    assert (tmp_path / "rows.jsonl.damaged").read_bytes() == spoiled
    again = RowStore(path, "k")
    assert again.damaged == [] and {row["v"] for row in again.rows.values()} == set(range(5))


def test_a_changed_value_is_damage(tmp_path: Path) -> None:
    path = tmp_path / "rows.jsonl"
    lines = _fill(path)
    lines[1] = lines[1].replace(b'"v":1', b'"v":7')
    path.write_bytes(b"".join(lines))
    store = RowStore(path, "k")
    assert "r1" not in store.rows and store.damaged == [2]


def test_a_full_disk_takes_all_of_a_row_or_nothing(tmp_path: Path) -> None:
    """A real limit of the operating system on the file's size: the write that crosses it is cut short."""
    path = tmp_path / "rows.jsonl"
    script = """
import resource, sys
from pathlib import Path
from chauffeur.bench.kernel.store import RowStore, StorageError
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
store = RowStore(Path(sys.argv[1]), "k")
for i in range(100):
    try:
        store.append({"k": f"r{i}", "v": "x" * 80})
    except StorageError as error:
        print(i, error)
        break
"""
    done = subprocess.run([sys.executable, "-c", script, str(path)], capture_output=True, text=True, check=True)
    written, _, said = done.stdout.partition(" ")
    assert "rows.jsonl" in said and "goes on where it stopped" in said
    content = path.read_bytes()
    assert content.endswith(b"\n") and content.count(b"\n") == int(written) > 3
    with RowStore(path, "k") as store:
        assert len(store.rows) == int(written) and store.damaged == []
        store.append({"k": "later", "v": 1})
    assert "later" in RowStore(path, "k").rows


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_scribe_says_that_the_disk_is_full(tmp_path: Path) -> None:
    path = tmp_path / "rows.jsonl"
    errors: list[ChauffeurError] = []
    scribe = Scribe(errors.append)
    store = RowStore(tmp_path / "other.jsonl", "k")
    full = RowStore(path, "k")
    path.symlink_to("/dev/full")
    scribe.write(store, {"k": "a"})
    for i in range(3):
        scribe.write(full, {"k": str(i)})
    with pytest.raises(StorageError, match="No space left"):
        scribe.close()
    assert len(errors) == 1
    assert set(RowStore(tmp_path / "other.jsonl", "k").rows) <= {"a"}


def test_a_scribe_writes_everything_in_order(tmp_path: Path) -> None:
    errors: list[ChauffeurError] = []
    scribe = Scribe(errors.append)
    stores = [RowStore(tmp_path / f"{name}.jsonl", "k") for name in "ab"]
    for i in range(2000):
        scribe.write(stores[i % 2], {"k": str(i % 500), "v": i})
    assert stores[0].rows["0"]["v"] == 1500, "shown at once"
    scribe.close()
    for store in stores:
        store.close()
    assert not errors
    for n, store in enumerate(stores):
        values = [json.loads(line)["v"] for line in store.path.read_text().splitlines()]
        assert values == list(range(n, 2000, 2))
        assert RowStore(store.path, "k").rows == store.rows


def test_what_is_no_json_is_refused_before_it_is_written(tmp_path: Path) -> None:
    scribe = Scribe(lambda error: None)
    store = RowStore(tmp_path / "rows.jsonl", "k")
    with pytest.raises(TypeError):
        scribe.write(store, {"k": "a", "v": object()})
    scribe.close()
    assert store.rows == {} and not store.path.exists()


def test_one_process_at_a_time_works_in_a_folder(tmp_path: Path) -> None:
    hold = "import sys, time; from pathlib import Path; from chauffeur.bench.kernel.store import sole_writer\n"
    hold += "with sole_writer(Path(sys.argv[1])):\n    print('in', flush=True)\n    time.sleep(60)"
    other = subprocess.Popen([sys.executable, "-c", hold, str(tmp_path)], stdout=subprocess.PIPE, text=True)
    assert other.stdout is not None and other.stdout.readline() == "in\n"
    with pytest.raises(ConfigError, match="Another process"), sole_writer(tmp_path):
        pass
    other.kill()
    other.wait()
    with sole_writer(tmp_path):  # a process that was killed holds nothing
        pass


def test_a_folder_that_cannot_be_used_is_said(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(StorageError, match="Cannot use the run folder"), sole_writer(tmp_path / "file" / "run"):
        pass
    (tmp_path / "rows.jsonl").mkdir()
    with pytest.raises(StorageError, match=r"rows\.jsonl"):
        RowStore(tmp_path / "rows.jsonl", "k")


def test_nobody_waits_for_the_disk(tmp_path: Path) -> None:
    """Handing rows to the scribe is a matter of microseconds, whatever fsync takes."""
    scribe = Scribe(lambda error: None)
    store = RowStore(tmp_path / "rows.jsonl", "k")
    row = {"k": "a", "text": "x" * 5000}
    started = time.process_time()
    for _ in range(500):
        scribe.write(store, row)
    spent_s = time.process_time() - started
    scribe.close()
    store.close()
    assert spent_s / 500 < 2e-3
    assert store.path.stat().st_size == 500 * len(seal(row))
