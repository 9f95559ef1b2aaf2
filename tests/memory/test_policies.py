"""A policy repository: kept, found again, shared, pruned; what comes from elsewhere is checked before it is used."""

from __future__ import annotations

import json
import multiprocessing
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from chauffeur.concept import DataError, ProgramError
from chauffeur.memory.policies import PolicyRepository, critic_labels, read_policies, superseded
from chauffeur.memory.policies_entry import PolicyEntry, content_id, fitting_name, read_entry, write_entry
from chauffeur.memory.policies_file import FILE, MAX_FILE_BYTES, MAX_LINE_BYTES


def entry(name: str = "go_left", command: str = "Switch to the left lane.", **fields: Any) -> PolicyEntry:
    source = fields.pop("source", f"def {name}():\n    while True:\n        yield autopilot()\n")
    values: dict[str, Any] = {
        "name": name, "version": 1, "description": "The car does it.", "described_by": "model", "source": source,
        "command": command, "context": "I am driving.", "world": "highway", "scenario": "left_lc_s0",
        "item": "left_lc_s0_c0", "outcome": "success", "metrics": (("lampilot-score-v1", 90.0),),
        "judged_by": "person", "critiques": ("Too late.",), "planner": "openai/m", "model": "m-1",
        "learned": "2026-11-01T10:00:00+00:00", "chauffeur": "0.1.0",
    } | fields  # fmt: skip
    parts = [values[key] for key in ("source", "command", "context", "scenario", "judged_by", "planner", "model")]
    return PolicyEntry(id=values.pop("id", content_id(*parts)), **values)


@pytest.fixture
def repository(tmp_path: Path) -> PolicyRepository:
    return PolicyRepository(tmp_path / "policies", create=True)


def test_what_is_committed_is_there_when_it_is_opened_again(repository: PolicyRepository) -> None:
    first = repository.commit(entry())
    second = repository.commit(entry("overtake_left", "Overtake on the left.", judged_by="evaluator"))
    again = PolicyRepository(repository.folder)
    assert again.entries == (first, second) and again.rejected == ()
    assert again.digest == repository.digest
    assert again.find("overtake_left") == second and again.find(first.id[:6]) == first
    assert first.score == 90.0
    with pytest.raises(DataError, match="no program 'nobody'"):
        again.find("nobody")


def test_names_that_collide_get_a_version_and_the_program_is_called_by_it(repository: PolicyRepository) -> None:
    repository.commit(entry())
    second = repository.commit(entry(command="Move over to the left."))
    third = repository.commit(
        entry(command="Left lane, please.", source="def go_left():\n    yield from go_left()\n    yield\n")
    )
    assert [e.callable_name for e in repository.entries] == ["go_left", "go_leftV2", "go_leftV3"]
    assert second.callable_source.startswith("def go_leftV2():")
    assert third.callable_source.startswith("def go_leftV3():") and third.source.startswith("def go_left():")
    repository.commit(entry("go_leftV4", "To the left."))
    assert repository.commit(entry(command="To the left now.")).callable_name == "go_leftV5"
    assert PolicyRepository(repository.folder).entries == repository.entries


def test_the_same_program_from_the_same_place_is_kept_once(repository: PolicyRepository) -> None:
    first = repository.commit(entry())
    assert repository.commit(entry(learned="2027-01-01T00:00:00+00:00", critiques=())) == first
    assert len(repository.entries) == 1


def test_the_nearest_programs_are_found_by_meaning(repository: PolicyRepository) -> None:
    for name, command, world in (
        ("left", "Switch to the left lane.", "highway"), ("right", "Switch to the right lane.", "highway"),
        ("closer", "Decrease the gap to 15 meters.", "highway"), ("wider", "Increase the gap to 60 meters.", "highway"),
        ("turn", "Turn left at the intersection.", "intersection"), ("halt", "Pull over and stop.", "highway"),
    ):  # fmt: skip
        repository.commit(entry(name, command, world=world, description=f"It does {name}."))

    def found(command: str, world: str = "highway", **more: Any) -> list[str]:
        return [one.entry.name for one in repository.recall(command, world, **more)]

    assert found("Change to the left lane, please")[0] == "left"
    assert found("Get into the right lane.")[0] == found("Make a right lane change.")[0] == "right"
    assert found("Reduce the following distance to 20 meters")[0] == "closer"
    assert found("Follow at a larger distance, 50 meters")[0] == "wider"
    assert found("At the crossroad make a left", "intersection")[0] == "turn"
    assert len(found("Anything at all")) == 3 and len(found("Turn left", k=1)) == 1 and found("x", k=0) == []
    likes = [one.similarity for one in repository.recall("Switch to the left lane.", "highway", 6)]
    assert likes == sorted(likes, reverse=True) and likes[0] > 0.8 and likes[-1] >= 0.0
    # A critique adds its words, never another wish.
    assert (
        found("Switch to the left lane.", critique="You went into the right lane instead, much too slowly.")[0]
        == "left"
    )


def test_of_programs_for_the_same_wish_only_the_newest_is_offered(repository: PolicyRepository) -> None:
    old = repository.commit(entry())
    new = repository.commit(
        entry(source="def go_left():\n    yield autopilot()\n", command="switch to the  LEFT lane.")
    )
    assert [one.entry for one in repository.recall("Switch to the left lane.", "highway")] == [new]
    assert superseded(repository.entries) == (old,)


def test_who_judged_is_always_said() -> None:
    person, machine = entry(), entry(judged_by="evaluator")
    assert critic_labels([]) == ()
    assert critic_labels([person]) == ("critic: person",)
    assert critic_labels([machine]) == ("critic: evaluator (not a person)",)
    assert critic_labels([person, machine]) == ("critic: evaluator (not a person) for 1 of 2 programs",)


def test_pruning_and_describing_keep_the_rest(repository: PolicyRepository) -> None:
    one, two = repository.commit(entry()), repository.commit(entry("halt", "Stop."))
    (repository.folder / FILE).open("ab").write(b"not one of ours\n")
    before = repository.digest
    described = repository.describe(repository.find("halt"), " It  stops.\n")
    assert (described.description, described.described_by) == ("It stops.", "person")
    assert repository.digest != before
    assert repository.prune({one.id}) == 1
    again = PolicyRepository(repository.folder)
    assert again.entries == (described,) and described.id == two.id
    assert [r.raw for r in again.rejected] == [b"not one of ours"], "what is not believed is not lost either"
    assert repository.prune((), drop_rejected=True) == 0 and PolicyRepository(repository.folder).rejected == ()
    with pytest.raises(DataError, match="characters"):
        repository.describe(described, "  ")


def test_exported_programs_are_taken_in_elsewhere_and_merged(repository: PolicyRepository, tmp_path: Path) -> None:
    repository.commit(entry())
    repository.commit(entry(command="Move over to the left."))
    repository.export(tmp_path / "team.jsonl", repository.entries)
    other = PolicyRepository(tmp_path / "other", create=True)
    mine = other.commit(entry(command="Left!"))
    entries, rejected = read_policies(tmp_path / "team.jsonl")
    assert rejected == ()
    merged = other.merge(entries, received="from team.jsonl")
    assert [e.callable_name for e in other.entries] == ["go_left", "go_leftV2", "go_leftV3"]
    assert [e.received for e in other.entries] == ["", "from team.jsonl", "from team.jsonl"]
    assert (len(merged.added), merged.known) == (2, 0)
    assert other.merge(entries).known == 2 and len(other.entries) == 3
    assert PolicyRepository(other.folder).entries == other.entries
    # And back again: only what is new there comes along.
    back = repository.merge(other.entries)
    assert (back.known, [e.id for e in back.added]) == (2, [mine.id])


def test_a_program_that_may_not_drive_is_not_kept(repository: PolicyRepository) -> None:
    for source in ("def go_left():\n    import os\n    yield\n", "x = 1\n", "def other():\n    yield\n"):
        with pytest.raises(ProgramError, match="not kept"):
            repository.commit(entry(source=source))
    assert not (repository.folder / FILE).exists()
    assert fitting_name("min") == fitting_name("autopilot") == fitting_name("__x") == fitting_name("größe") == "program"
    assert fitting_name("class") == fitting_name("math") == "program" and fitting_name("overtake_2") == "overtake_2"


def line(**changes: Any) -> bytes:
    return json.dumps(json.loads(write_entry(entry())) | changes).encode()


def forged(**fields: Any) -> bytes:
    """An entry whose id fits its content, as whoever means harm would make it."""
    return write_entry(entry(**fields))


HOSTILE = {
    "no JSON": b"{",
    "another thing": b'{"schema": "something"}',
    "a list": b"[1]",
    "nested without end": b"[" * 100_000,
    "a number without end": b'{"schema": "chauffeur-policy-v1", "version": ' + b"9" * 6000 + b"}",
    "an unknown field": line(run_this="rm -rf /"),
    "a wrong type": line(description=5),
    "no number": line(metrics=[["score", float("nan")]]),
    "a lone surrogate": line(description="\ud800"),
    "a long description": line(description="x" * 2000),
    "a changed program": line(source="def go_left():\n    yield\n"),
    "a changed judge": line(judged_by="evaluator"),
    "a judge of its own": line(judged_by="the pope"),
    "another id": line(id="0" * 16),
    "a huge version": line(version=10**9),
    "an import": forged(source="def go_left():\n    import os\n    os.system('id')\n    yield\n"),
    "an endless loop": forged(source="def go_left():\n    while True:\n        pass\n    yield\n"),
    "code before the drive": forged(source="set_target_speed(90)\ndef go_left():\n    yield\n"),
    "two functions": forged(source="def go_left():\n    yield\n\ndef min(a, b):\n    return 0\n"),
    "a driving API": forged(name="autopilot", source="def autopilot():\n    yield\n"),
    "a built-in": forged(name="min", source="def min():\n    yield\n"),
    "a private name": forged(name="__find__", source="def __find__():\n    yield\n"),
    "a look-alike name": forged(name="ѕay", source="def ѕay():\n    yield\n"),
    "a path": forged(name="../../x", source="def go_left():\n    yield\n"),
    "another name": forged(name="stop", source="def go_left():\n    yield\n"),
    "a giant line": line(context="x" * MAX_LINE_BYTES),
}  # fmt: skip


@pytest.mark.parametrize("case", HOSTILE)
def test_what_cannot_be_believed_is_set_aside_and_the_rest_works(tmp_path: Path, case: str) -> None:
    good = write_entry(entry("halt", "Stop."))
    (tmp_path / FILE).write_bytes(HOSTILE[case] + b"\n" + good)
    repository = PolicyRepository(tmp_path)
    assert [e.name for e in repository.entries] == ["halt"]
    assert [r.line for r in repository.rejected] == [1] and repository.rejected[0].reason


def test_an_entry_is_the_same_after_its_line() -> None:
    one = entry(description="Fährt nach links. 速度 \U0001f697", metrics=(("a", 0.1 + 0.2),))
    assert read_entry(write_entry(one)) == one


def test_twins_are_believed_once(tmp_path: Path) -> None:
    (tmp_path / FILE).write_bytes(write_entry(entry()) * 2 + write_entry(replace(entry(command="Else."), version=1)))
    repository = PolicyRepository(tmp_path)
    assert len(repository.entries) == 1 and [r.line for r in repository.rejected] == [2, 3]


def test_only_a_plain_file_of_a_bearable_size_is_read(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no policy repository"):
        PolicyRepository(tmp_path)
    secret = tmp_path / "secret"
    secret.write_text("my own\n")
    shared = tmp_path / "shared"
    shared.mkdir()
    (shared / FILE).symlink_to(secret)
    with pytest.raises(DataError, match="cannot be used"):
        PolicyRepository(shared)
    with pytest.raises(DataError, match="cannot be used"):
        PolicyRepository(shared, create=True)
    assert secret.read_text() == "my own\n"
    (shared / FILE).unlink()
    os.mkfifo(shared / FILE)
    with pytest.raises(DataError, match="not a plain file"):
        read_policies(shared / FILE)
    (shared / FILE).unlink()
    with (shared / FILE).open("wb") as file:
        file.truncate(MAX_FILE_BYTES + 1)
    with pytest.raises(DataError, match="bytes"):
        PolicyRepository(shared)


def test_a_line_cut_off_by_a_crash_does_not_swallow_the_next(repository: PolicyRepository) -> None:
    repository.commit(entry())
    path = repository.folder / FILE
    path.write_bytes(path.read_bytes() + write_entry(entry("halt", "Stop."))[:40])
    repository.commit(entry("wider", "Keep away."))
    again = PolicyRepository(repository.folder)
    assert [e.name for e in again.entries] == ["go_left", "wider"] and len(again.rejected) == 1


def add(folder: Path, number: int) -> None:
    repository = PolicyRepository(folder, create=True)
    for index in range(10):
        repository.commit(entry(command=f"Wish {number}.{index}"))


def test_two_processes_add_at_once(tmp_path: Path) -> None:
    context = multiprocessing.get_context("fork")
    workers = [context.Process(target=add, args=(tmp_path / "shared", number)) for number in range(2)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join(60)
        assert worker.exitcode == 0
    repository = PolicyRepository(tmp_path / "shared")
    assert repository.rejected == ()
    assert len({e.callable_name for e in repository.entries}) == len(repository.entries) == 20


def test_a_full_repository_says_so(repository: PolicyRepository, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("chauffeur.memory.policies.MAX_ENTRIES", 1)
    repository.commit(entry())
    with pytest.raises(DataError, match="1 are the most"):
        repository.commit(entry("halt", "Stop."))
    assert len(PolicyRepository(repository.folder).entries) == 1
