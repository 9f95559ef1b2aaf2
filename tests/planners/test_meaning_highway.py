"""Acts as steps of the dialect: every skill is found from its own acts, and what no step says is named or asked."""

from __future__ import annotations

from dataclasses import replace

import pytest

from chauffeur.concept import Lead, Situation
from chauffeur.concept.utterance import Act, acts_from_json
from chauffeur.models.meaning.labelled import act_of
from chauffeur.planners.meaning.dialect_acts import CONDITION_ACTS, MANNER_ACTS, SKILL_ACTS
from chauffeur.planners.meaning.highway import steps_of
from chauffeur.planners.onboard.dialect import CONDITIONS, SKILLS, DialectStep, Number, StepCondition

HIGHWAY = Situation("highway", 25.0, 31.2928, 4, 1, True, Lead(1, 35.0, 22.0), None)
SAID = {"speed": "mph", "distance": "ft", "time": "s", "factor": "share", "lanes": "lanes"}
UNIT = {"speed": "mph", "distance": "feet"}


def acts(label: str, unit: str = "") -> tuple[Act, ...]:
    """Acts of a label, with 3 of a unit where it has a number."""
    found = [act_of(part) for part in label.split(" + ")]
    return tuple(replace(act, value=3.0, unit=unit) if valued else act for act, valued, _ in found)


@pytest.mark.parametrize("name", SKILL_ACTS)
def test_a_skill_is_found_from_its_acts(name: str) -> None:
    takes = SKILLS[name].takes
    number = None if takes is None else Number(3.0, UNIT.get(takes, ""))
    assert steps_of(acts(SKILL_ACTS[name], SAID.get(takes or "", "")), HIGHWAY).steps == (DialectStep(name, number),)


@pytest.mark.parametrize("manner", MANNER_ACTS)
def test_a_manner_is_found(manner: str) -> None:
    assert steps_of(acts(f"lane side:left {MANNER_ACTS[manner]}"), HIGHWAY).steps == (
        DialectStep("lane_left", manner=manner),
    )


@pytest.mark.parametrize("how", ["if", "once"])
@pytest.mark.parametrize("name", CONDITION_ACTS)
def test_a_condition_is_found(name: str, how: str) -> None:
    kind = CONDITIONS[name][0]
    (act,) = acts(f"speed direction:slower W:{how} {CONDITION_ACTS[name]}")
    assert act.when is not None
    if kind is not None:
        act = replace(act, when=replace(act.when, value=3.0, unit=SAID[kind]))
    number = None if kind is None else Number(3.0, UNIT[kind])
    wanted = DialectStep("slower", condition=StepCondition(how, name, number))  # type: ignore[arg-type]
    assert steps_of((act,), HIGHWAY).steps == (wanted,)


@pytest.mark.parametrize(
    ("said", "calls"),
    [
        ([{"act": "speed", "direction": "faster", "value": 60.0, "unit": "mph"}], ["drive_at(mph(60))"]),
        ([{"act": "speed", "value": 60.0}], ["drive_at(mph(60))"]),
        ([{"act": "speed", "value": 110.0}], ["drive_at(kmh(110))"]),
        ([{"act": "speed", "value": 80.0, "direction": "slower"}], ["drive_at(kmh(80))"]),
        ([{"act": "speed", "direction": "slower", "measure": "by", "value": 0.1, "unit": "share"}],
         ["speed_times(0.9)"]),
        ([{"act": "gap", "value": 0.5, "unit": "share"}], ["gap_times(0.5)"]),
        ([{"act": "gap", "direction": "more", "value": 40.0, "unit": "m"}], ["gap_of(40)"]),
        ([{"act": "gap", "value": 40.0}], ["gap_of(40)"]),
        ([{"act": "lane", "side": "left", "value": 1.0, "unit": "lanes"}], ["lane_left()"]),
        ([{"act": "lane", "target": {"kind": "lane", "side": "left"}}], ["lane_left()"]),
        ([{"act": "lane", "side": "left"}, {"act": "pass"}], ["overtake_left()"]),
        ([{"act": "lane", "side": "left"}, {"act": "lane", "to": "original"}], ["lane_left()", "lane_right()"]),
        ([{"act": "go", "manner": "slow"}], ["slower()"]),
        ([{"act": "park"}], ["pull_over()"]),
        ([{"act": "speed", "direction": "faster", "not": True}], ["hold_speed()"]),
        ([{"act": "speed", "direction": "faster", "not": True, "value": 100.0, "unit": "km/h"}], ["at_most(kmh(100))"]),
        ([{"act": "gap", "direction": "less", "not": True, "value": 30.0, "unit": "m"}], ["gap_at_least(30)"]),
        ([{"act": "lane", "side": "left", "not": True}, {"act": "lane", "side": "right"}], ["lane_right()"]),
        ([{"act": "lane", "not": True}, {"act": "speed", "direction": "slower"}], ["slower()"]),
        ([{"act": "wait", "target": {"kind": "vehicles"}}, {"act": "turn", "side": "left"}],
         ["let_in()", "turn_left()"]),
        ([{"act": "speed", "direction": "slower", "purpose": True}, {"act": "keep"}], ["keep_lane()"]),
    ],
)  # fmt: skip
def test_what_is_said_otherwise_is_the_same_step(said: list[dict[str, object]], calls: list[str]) -> None:
    assert [step.call() for step in steps_of(acts_from_json(said), HIGHWAY).steps] == calls


def test_a_time_is_waited_before_what_follows() -> None:
    ten = {"type": "once", "event": "time", "value": 10.0, "unit": "s"}
    wanted = (DialectStep("lane_right", wait_s=Number(10.0)),)
    for said in (
        [{"act": "lane", "side": "right", "when": ten}],
        [{"act": "wait", "when": ten}, {"act": "lane", "side": "right"}],
    ):
        assert steps_of(acts_from_json(said), HIGHWAY).steps == wanted


@pytest.mark.parametrize(
    ("again", "call"),
    [
        ({"act": "again"}, "gap_of(40)"),
        ({"act": "again", "direction": "less"}, "gap_of(0.85 * 40)"),
        ({"act": "again", "direction": "more", "measure": "by", "value": 10.0, "unit": "m"}, "gap_of(50)"),
    ],
)
def test_again_is_what_was_driven_before(again: dict[str, object], call: str) -> None:
    before = (DialectStep("gap_of", Number(40.0)),)
    assert [step.call() for step in steps_of(acts_from_json([again]), HIGHWAY, before).steps] == [call]
    assert steps_of(acts_from_json([again]), HIGHWAY).question


@pytest.mark.parametrize(
    "said",
    [
        {"act": "speed"},
        {"act": "gap"},
        {"act": "turn"},
        {"act": "unclear"},
        {"act": "pick", "side": "left"},
        {"act": "speed", "value": 50.0, "unit": "km/h", "measure": "by"},
        {"act": "speed", "value": 50.0, "unit": "km/h", "not": True},
    ],
)
def test_what_is_not_clear_is_asked(said: dict[str, object]) -> None:
    found = steps_of(acts_from_json([said, {"act": "lane", "side": "left"}]), HIGHWAY)
    assert found.question.endswith("?")
    assert not found.steps


def test_more_and_less_at_once_is_asked() -> None:
    said = [{"act": "speed", "direction": "faster"}, {"act": "speed", "direction": "slower"}]
    assert steps_of(acts_from_json(said), HIGHWAY).question


@pytest.mark.parametrize(
    "said",
    [
        {"act": "u_turn"},
        {"act": "goto", "target": {"kind": "building"}},
        {"act": "speed", "value": 50.0, "unit": "m"},
        {"act": "gap", "direction": "more", "target": {"kind": "car", "where": "behind"}},
        {"act": "stop", "place": {"rel": "at", "ref": {"kind": "lot"}}},
        {"act": "lane", "side": "left", "when": {"type": "once", "event": "green"}},
        {"act": "lane", "side": "left", "when": {"type": "once", "event": "time", "value": 2.0, "unit": ""}},
    ],
)
def test_what_no_step_says_is_named_and_the_rest_is_driven(said: dict[str, object]) -> None:
    found = steps_of(acts_from_json([said, {"act": "pull_over"}]), HIGHWAY)
    assert [step.skill for step in found.steps] == ["pull_over"]
    assert [one.act.act for one in found.undoable] == [said["act"]]
