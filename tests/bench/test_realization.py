"""Labelled commands, staged, driven and judged: what can be staged, whom words mean there, and what a row says."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("libsumo")

from chauffeur.bench.kernel.benchmark import ItemOutcome
from chauffeur.bench.kernel.conformance import faults
from chauffeur.bench.realization import RealizationBenchmark, realization, stage_of
from chauffeur.concept import DataError
from chauffeur.concept.utterance import Reference, acts_from_json

SILVER = {"kind": "car", "colour": "silver"}
PARK = {"act": "park", "place": {"rel": "behind", "ref": SILVER}}
RIGHT = {"act": "turn", "side": "right"}


def staged(*acts: dict[str, Any]) -> Any:
    return stage_of(acts_from_json(list(acts)))


def commands(folder: Path, *rows: tuple[str, list[dict[str, Any]]]) -> Path:
    file = folder / "commands.jsonl"
    lines = [json.dumps({"id": f"c{k}", "text": text, "acts": acts, "clear": 1}) for k, (text, acts) in enumerate(rows)]
    file.write_text("\n".join(lines))
    return file


def test_what_is_named_is_there_with_a_distractor_in_another_colour() -> None:
    scene = staged(PARK)
    (place,) = scene.referents[Reference("car", "silver")]
    meant = scene.actors[place]
    others = [one for k, one in enumerate(scene.actors) if k != place]
    assert (meant.kind, meant.colour) == ("car", "silver")
    assert [(one.kind, one.colour != "silver") for one in others] == [("car", True)]
    assert others[0].ahead_m < meant.ahead_m


def test_what_is_told_after_a_turn_is_round_the_corner() -> None:
    assert all(actor.way == ("right",) for actor in staged(RIGHT, PARK).actors)
    assert all(actor.way == () for actor in staged(PARK, RIGHT).actors)


@pytest.mark.parametrize(
    "acts",
    [
        [{"act": "u_turn"}],
        [{"act": "stop", "place": {"rel": "at", "ref": {"kind": "gate"}}}],
        [{"act": "turn"}],
        [{"act": "wait", "when": {"type": "until", "event": "opens", "ref": {"kind": "gate"}}}],
        [],
    ],
)
def test_what_a_town_cannot_stage_has_no_scene(acts: list[Any]) -> None:
    assert staged(*acts) is None


@pytest.mark.parametrize(
    ("text", "acts", "reader", "came"),
    [
        ("Park behind the silver car.", [PARK], "labels", "whole"),
        ("Park behind the silver car.", [PARK], "meaning", "whole"),
        ("Turn right.", [RIGHT], "meaning", "whole"),
        ("Turn right.", [{"act": "turn", "side": "left"}], "meaning", "opposite"),  # judged by the label, not the words
        ("Park behind the red car.", [PARK], "meaning", "none"),  # the distractor is red: words and label differ
        ("Turn right.", [RIGHT], "blind", "none"),
        ("Make a phone call.", [RIGHT], "meaning", "declined"),
        ("Turn right, then enter the parking lot.", [RIGHT], "meaning", "asked"),
    ],
)
def test_what_came_of_a_command(tmp_path: Path, text: str, acts: list[Any], reader: str, came: str) -> None:
    bench = RealizationBenchmark(commands(tmp_path, (text, acts)), [reader])
    (item,) = bench.items()
    result = bench.job(item, None).run()
    (row,) = bench.rows(ItemOutcome(item, None, "", result))
    assert (row.came, row.collision) == (came, False), row
    assert "simulated" in row.note


def test_it_is_a_benchmark_of_the_kernel(tmp_path: Path) -> None:
    bench = realization(str(commands(tmp_path, ("Turn right.", [RIGHT]), ("Turn round.", [{"act": "u_turn"}]))))
    assert faults(bench) == []
    assert [item.id for item in bench.items()] == ["c0/labels", "c0/meaning", "c0/keyword", "c0/blind"]


def test_real_commands_are_staged(commands_data: Path) -> None:
    bench = RealizationBenchmark(commands_data, ["labels"])
    assert len(bench.items()) > 150
    assert len(RealizationBenchmark(commands_data, ["labels"], 20).items()) == 20


@pytest.mark.parametrize(
    "content", ["", "[1]", '{"id": "x"}', '{"id": "x", "text": "y", "acts": [{"act": "fly"}]}', "{"]
)
def test_other_files_are_refused(tmp_path: Path, content: str) -> None:
    file = tmp_path / "commands.jsonl"
    file.write_text(content)
    with pytest.raises(DataError):
        RealizationBenchmark(file, ["labels"])


def test_no_commands_are_refused() -> None:
    with pytest.raises(DataError):
        realization()
