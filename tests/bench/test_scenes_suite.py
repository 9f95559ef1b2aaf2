"""Whole suites: numbers, files, resuming, checking, and the command line."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from chauffeur.bench.lampilot.families import family_of
from chauffeur.bench.lampilot.scenes import annotated
from chauffeur.bench.lampilot.scenes.item_maker import Job, make_item
from chauffeur.bench.lampilot.scenes.kinds import (
    EXTRAS,
    KINDS,
    MAIN,
    PAPER_FAMILIES,
    PAPER_ROADS,
    apportion,
    plan_suite,
)
from chauffeur.bench.lampilot.scenes.scene_check import Fault, check, counts, folders_of, statistics_of, table
from chauffeur.bench.lampilot.scenes.suite import Suite, SuiteConfig
from chauffeur.bench.lampilot.scenes.wording_choice import normal
from chauffeur.cli.main import app
from chauffeur.concept import ConfigError, DataError
from chauffeur.driving.judge.goals import make_goal
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.dblv1 import load_dataset
from chauffeur.worlds.highway.scenarios import BUILT_IN

CONFIG = SuiteConfig(n=11, seed=5, extras=6)


def _quiet(done: int, total: int) -> None:
    pass


def _files(folder: Path) -> dict[str, str]:
    """Hashes of what a suite is; the order in which items were made is not part of it."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name != "scenes.jsonl"
    }


@pytest.fixture(scope="module")
def suite(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Any]:
    """A small suite, made for real, interrupted once on the way."""
    folder = tmp_path_factory.mktemp("made") / "suite"

    def impatient(done: int, total: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    begun = Suite(folder, CONFIG)
    with pytest.raises(KeyboardInterrupt):
        begun.generate(1, impatient)
    assert begun.made == 3
    assert not (folder / "manifest.json").exists()
    with pytest.raises(DataError, match="not finished"):
        folders_of(folder)
    kept = (folder / "scenes.jsonl").read_bytes()
    resumed = Suite(folder, CONFIG)
    assert resumed.made == 3
    manifest = resumed.generate(1, _quiet)
    assert (folder / "scenes.jsonl").read_bytes().startswith(kept)
    return folder, manifest


# The plan


def test_the_full_plan_has_the_papers_numbers() -> None:
    slots = plan_suite(4900, 0, 980)
    main = [slot for slot in slots if slot.split != "extras"]
    assert Counter(KINDS[slot.kind].family for slot in main) == PAPER_FAMILIES
    assert Counter(slot.split for slot in slots) == {"train": 3900, "val": 500, "test": 500, "extras": 980}
    roads = Counter("intersection" if KINDS[slot.kind].family == "routing" else "highway" for slot in main)
    assert roads == PAPER_ROADS
    assert len({slot.index for slot in slots}) == len(slots)
    test = [slot for slot in main if slot.split == "test"]
    assert sum(slot.held for slot in test) == pytest.approx(len(test) / 2, abs=len(MAIN) / 2)
    assert not any(slot.held for slot in main if slot.split != "test")
    for kind in MAIN:
        here = Counter(slot.split for slot in main if slot.kind == kind.name)
        assert here["test"] == pytest.approx(here.total() * 500 / 4900, abs=1)


@given(n=st.integers(1, 700), extras=st.integers(0, 150), seed=st.integers(0, 9))
def test_plans_of_any_size_add_up(n: int, extras: int, seed: int) -> None:
    slots = plan_suite(n, seed, extras)
    splits = Counter(slot.split for slot in slots)
    assert splits["extras"] == extras
    assert splits["train"] + splits["val"] + splits["test"] == n
    assert splits["test"] == round(n * 500 / 4900)
    assert slots == plan_suite(n, seed, extras)


@given(st.integers(0, 500), st.lists(st.integers(0, 50), min_size=1, max_size=20))
def test_apportioning_is_fair_and_exact(total: int, weights: list[int]) -> None:
    parts = apportion(total, weights)
    whole = sum(weights)
    assert sum(parts) == (total if whole else 0)
    assert all(abs(part - total * w / whole) < 1 for part, w in zip(parts, weights, strict=True) if whole)


@pytest.mark.parametrize(("n", "extras"), [(0, 0), (10, -1)])
def test_plans_of_nothing_are_refused(n: int, extras: int) -> None:
    with pytest.raises(ConfigError):
        plan_suite(n, 0, extras)


@pytest.mark.slow
def test_every_kind_can_be_made() -> None:
    """One item of each kind of the extras; those of the original are in the suite below."""
    first = {slot.kind: slot for slot in reversed(plan_suite(1, 3, 980)) if slot.part}
    assert set(first) == {kind.name for kinds in EXTRAS.values() for kind in kinds}
    for kind, slot in first.items():
        row = make_item(Job(3, slot))
        assert row["wordings"], kind
        assert row["right"] == {"refuse": "refuse", "ask": "ask"}.get(kind.split("_", 1)[0], "drive")


# What is written


def test_folders_hold_exactly_what_was_planned(suite: tuple[Path, Any]) -> None:
    folder, manifest = suite
    assert manifest["items"] == {name: len(load_dataset(path).items()) for name, path in folders_of(folder).items()}
    assert sum(manifest["items"][name] for name in ("train", "val", "test")) == CONFIG.n
    assert sum(count for name, count in manifest["items"].items() if name.startswith("extras/")) == CONFIG.extras
    assert manifest == json.loads((folder / "manifest.json").read_text())
    for name, path in folders_of(folder).items():
        assert load_dataset(path).sha256 == manifest["sha256"][name]["tasks"]


def test_lampilots_own_reader_reads_it(suite: tuple[Path, Any]) -> None:
    """Its reader, step by step: names split at newlines, ids cut at dots and `_c`."""
    folder, _ = suite
    words = ("ACCEvalbySpeed", "ACCEvalbyDistance", "LaneChangeEval", "OvertakeEval", "PullOverEval")
    for path in folders_of(folder).values():
        ours = {item.id: item for item in load_dataset(path).items()}
        for name in (path / "config_list.txt").read_text().split("\n"):
            task = json.loads((path / name).read_text())
            assert name.count(".") == 1
            (sample,), (command,) = task["samples"], task["commands"]
            item = f"{name.split('.')[0]}_s0_c0"
            assert ours.pop(item).command == command
            assert item.split("_c", 1)[0] == item.removesuffix("_c0")
            assert sample["eval"]["type"] in (*words, "IntersectionEval")
            assert set(sample) == {"env", "eval", "seed"}
        assert not ours


def test_annotations_agree_with_scenes(suite: tuple[Path, Any]) -> None:
    folder, _ = suite
    for name, path in folders_of(folder).items():
        dataset, notes = annotated(load_dataset(path))
        assert set(notes) == {item.id for item in dataset.items()}
        for item in dataset.items():
            note = notes[item.id]
            world = HighwayWorld()
            world.reset(item.scenario)
            make_goal(world.perception(), item.scenario)  # can be judged
            assert note.split == name.split("/")[0]
            assert (note.right == "drive") == (note.expert_s > 0)
            assert (note.phrasing == "") == (note.split == "extras")
            assert bool(note.why) == (note.right != "drive")
            assert note.part or family_of(item.task) == KINDS[note.kind].family


@pytest.mark.slow
def test_the_same_seed_gives_the_same_suite_with_any_number_of_workers(suite: tuple[Path, Any], tmp_path: Path) -> None:
    Suite(tmp_path / "again", CONFIG).generate(2, _quiet)
    assert _files(tmp_path / "again") == _files(suite[0])


@pytest.mark.slow
def test_a_finished_suite_passes_its_own_check(suite: tuple[Path, Any]) -> None:
    items, faults = check(suite[0], 1, _quiet)
    assert items == CONFIG.n + CONFIG.extras
    assert faults == []


def test_rejections_are_counted(suite: tuple[Path, Any]) -> None:
    scenes = suite[1]["scenes"]["main"]
    assert scenes["kept"] == CONFIG.n
    assert scenes["drawn"] == CONFIG.n + sum(scenes["rejected"].values())
    assert all(held["drawn"] >= held["rejected"] for held in suite[1]["words"].values())


def test_another_suite_in_the_same_folder_is_refused(suite: tuple[Path, Any], tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="another configuration"):
        Suite(suite[0], SuiteConfig(n=12, seed=5, extras=6))
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(ConfigError, match="not empty"):
        Suite(tmp_path, CONFIG)
    with pytest.raises(ConfigError, match="seed"):
        Suite(tmp_path / "new", SuiteConfig(n=1, seed=-1, extras=0))


def test_a_kind_without_feasible_scenes_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("chauffeur.bench.lampilot.scenes.item_maker.MAX_DRAWS", 3)
    monkeypatch.setattr("chauffeur.bench.lampilot.scenes.item_maker.start_of", lambda world, scenario: "never")
    with pytest.raises(Exception, match=r"left_lc.*never \(3\)"):
        make_item(Job(0, next(slot for slot in plan_suite(40, 0, 0) if slot.kind == "left_lc")))


# Checking and counting


@pytest.fixture
def faulty(tmp_path: Path) -> Path:
    """Four items: one sound, two whose words say another side, one that nobody can do."""
    overtake = next(s for s in BUILT_IN if s.id == "overtake")
    left = {"type": "LaneChangeEval", "direction": "left"}
    right = {"type": "LaneChangeEval", "direction": "right"}
    for name, words, goal in (
        ("left_lc_0", "Take the left lane.", left),
        ("left_lc_1", "Take the right lane.", left),
        ("left_lc_3", "Take the right lane!", left),
        ("right_lc_2", "Take the right lane.", right),
    ):
        sample = {"env": overtake.config, "eval": goal, "seed": overtake.seed}
        (tmp_path / f"{name}.json").write_text(json.dumps({"commands": [words], "samples": [sample]}))
    return tmp_path


@pytest.mark.slow
def test_check_finds_what_is_wrong(faulty: Path) -> None:
    items, faults = check(faulty, 1, _quiet)
    assert items == 4
    assert Fault("words", "left_lc_1_s0_c0", "side", "Take the right lane.") in faults
    assert Fault("scene", "right_lc_2_s0", "There is no lane to the right of the ego.") in faults
    assert [why for what, why, _ in counts(faults) if what == "repeated"] == ["said 3 times"]
    assert len(faults) == 6


def test_statistics_stand_next_to_the_papers(lampilot_data: Path) -> None:
    ours = statistics_of([load_dataset(lampilot_data / "DbLv1-dev")])
    assert ours.items == 3136
    assert ours.scenes == 392
    assert ours.words == (2, pytest.approx(7.58, abs=0.01), 14)
    rows = {name: (here, paper) for name, here, paper in table(ours)}
    assert rows["Routing"] == ("960 (30.6%)", "1,500 (30.6%)")
    assert rows["Average instruction length, words"] == ("7.6", "7.6")


@pytest.mark.slow
def test_command_line(suite: tuple[Path, Any], faulty: Path, tmp_path: Path) -> None:
    runner = CliRunner()
    shown = runner.invoke(app, ["bench", "scenes", "stats", str(suite[0])])
    assert shown.exit_code == 0
    assert "Average instruction length" in shown.output
    assert "extras/directness" in shown.output
    again = runner.invoke(
        app, ["bench", "scenes", "generate", "--items", "11", "--seed", "5", "--extras", "6", "--out", str(suite[0])]
    )
    assert again.exit_code == 0, again.output
    assert "Next: chauffeur bench lampilot" in again.output
    wrong = runner.invoke(
        app, ["bench", "scenes", "check", str(faulty), "--workers", "1", "--out", str(tmp_path / "f.jsonl")]
    )
    assert wrong.exit_code == 1
    assert "Take the right lane." in wrong.output
    assert len((tmp_path / "f.jsonl").read_text().splitlines()) == 6
    for arguments in (
        ["stats", str(tmp_path / "nowhere")],
        ["check", str(tmp_path / "nowhere")],
        ["generate", "--out", str(faulty)],
        ["generate", "--items", "11", "--seed", "6", "--out", str(suite[0])],
    ):
        assert runner.invoke(app, ["bench", "scenes", *arguments]).exit_code == 2, arguments


@pytest.mark.slow
def test_what_is_to_be_avoided_is_avoided(suite: tuple[Path, Any], tmp_path: Path) -> None:
    """A suite made beside another one says none of its sentences."""
    other = load_dataset(suite[0] / "train")
    theirs = {normal(item.command) for item in other.items()}
    config = SuiteConfig(n=12, seed=5, extras=0, avoid_sha256=other.sha256)
    Suite(tmp_path / "other", config, other).generate(1, _quiet)
    ours = [load_dataset(path) for path in folders_of(tmp_path / "other").values()]
    assert not {normal(item.command) for dataset in ours for item in dataset.items()} & theirs
