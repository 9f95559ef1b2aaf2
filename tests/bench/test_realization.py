"""Labelled commands, staged, driven and judged: what can be staged, whom words mean there, and what a row says."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("libsumo")

from chauffeur.bench.kernel.benchmark import ItemOutcome
from chauffeur.bench.kernel.conformance import faults
from chauffeur.bench.realization import RealizationBenchmark, highway_scenario, realization, stage_of
from chauffeur.bench.realization.stage import ENDS, FAR, LEFT_LANE, RIGHT_LANE, SIDE_STREETS
from chauffeur.concept import ConfigError, DataError
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
    assert [item.id for item in bench.items()] == [
        "c0/town/labels",
        "c0/town/meaning",
        "c0/town/keyword",
        "c0/town/blind",
    ]


def test_real_commands_are_staged(commands_data: Path) -> None:
    bench = RealizationBenchmark(commands_data, ["labels"])
    assert len(bench.items()) > 230
    assert len(RealizationBenchmark(commands_data, ["labels"], 20).items()) == 20


@pytest.mark.parametrize(
    "content", ["", "[1]", '{"id": "x"}', '{"id": "x", "text": "y", "acts": [{"act": "fly"}]}', "{"]
)
def test_other_files_are_refused(tmp_path: Path, content: str) -> None:
    file = tmp_path / "commands.jsonl"
    file.write_text(content)
    with pytest.raises(DataError):
        RealizationBenchmark(file, ["labels"])


def test_a_folder_without_commands_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError):
        realization(str(tmp_path))


def test_our_own_commands_are_read_by_default() -> None:
    bench = realization(readers="labels")
    assert {item.set for item in bench.items()} == {"town_a", "town_b"}
    assert len(bench.items()) > 200


JUNCTION = {"kind": "junction"}
LEFT = {"act": "turn", "side": "left"}
RED = {"kind": "car", "colour": "red"}


@pytest.mark.parametrize(
    ("acts", "start"),
    [
        ([LEFT], LEFT_LANE),
        ([LEFT | {"place": {"rel": "after", "ref": {"kind": "bus"}}}], SIDE_STREETS["left"]),  # a kerb, and a left turn
        ([RIGHT, {"act": "lane", "side": "left"}], SIDE_STREETS["right"]),  # into a street of two lanes
        ([LEFT | {"place": {"rel": "at", "ref": {"kind": "end_of_road"}}}], ENDS["left"]),
        ([LEFT | {"place": {"rel": "at", "ref": JUNCTION | {"ordinal": 2}}}], FAR["left"]),
        ([{"act": "lane", "to": "rightmost"}], LEFT_LANE),
        ([{"act": "keep", "side": "right"}], RIGHT_LANE),
    ],
)
def test_a_command_is_said_where_it_can_be_done(acts: list[Any], start: Any) -> None:
    assert staged(*acts).start == start


def test_an_ordinal_has_others_like_it_before_and_behind() -> None:
    scene = staged({"act": "stop", "place": {"rel": "beside", "ref": RED | {"ordinal": 2}}})
    assert {(one.kind, one.colour) for one in scene.actors} == {("car", "red")}
    assert scene.referents == {Reference("car", "red", ordinal=2): (1,)}


def test_what_is_spoken_of_again_is_there_once() -> None:
    scene = staged(
        {"act": "yield", "target": {"kind": "car", "colour": "red", "state": "oncoming"}},
        {"act": "follow", "target": {"kind": "car", "deictic": True}},
    )
    assert len(set(scene.referents.values())) == 1


def test_a_distractor_is_nothing_else_that_is_named() -> None:
    blue = {"kind": "car", "colour": "blue"}
    scene = staged(
        PARK | {"not": True, "place": {"rel": "behind", "ref": RED}}, PARK | {"place": {"rel": "behind", "ref": blue}}
    )
    assert [one.colour for one in scene.actors].count("blue") == 1


@pytest.mark.parametrize(
    ("acts", "road"),
    [
        ([{"act": "pass", "target": {"kind": "vehicle", "where": "ahead"}}], "ramp-merge-v0"),
        ([{"act": "pull_over"}], "dt-highway-v0"),
        ([RIGHT], "dt-intersection-v0"),
        ([RIGHT, LEFT], None),
        ([{"act": "follow", "target": RED}], None),  # its vehicles have no colours
        ([PARK], None),
    ],
)
def test_what_a_highway_can_stage(acts: list[Any], road: str | None) -> None:
    scenario = highway_scenario(acts_from_json(acts), "x")
    assert (scenario and scenario.config["type"]) == road


def test_a_world_without_a_stage_is_refused() -> None:
    with pytest.raises(ConfigError):
        realization(worlds="track")
