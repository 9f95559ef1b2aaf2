"""The on-board VLM as a planner: what it does with its camera, the weather service and what is remembered."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from chauffeur.bench.motion.items import MotionItem, commands
from chauffeur.concept import (
    ActionMatrix,
    CameraImage,
    Context,
    DataError,
    Feedback,
    History,
    HistoryItem,
    Instruction,
    InstructionError,
    Plan,
    PlanRequest,
    Situation,
    SystemMessage,
)
from chauffeur.planners.base import Planner, looks
from chauffeur.planners.camera_faults import HEIGHT, WIDTH, camera_fault, small
from chauffeur.planners.keyword import KeywordPlanner
from chauffeur.planners.vlm import VlmPlanner
from chauffeur.planners.vlm.engine import VlmEngine, VlmReading, shipped
from chauffeur.planners.vlm.planner import RECALL_SETTING, recalled, task_of
from chauffeur.planners.vlm.taste import TASTE_SETTING, JudgedDrive, taste_of
from chauffeur.planners.vlm.template import GAINS, LEVELS, STYLES, TEMPLATE, GainCodebook
from chauffeur.safety.gain_box import care, gain_box, moved
from chauffeur.worlds.track.manoeuvres import ManoeuvreName

CODEBOOK = GainCodebook.of(gain_box())
SITUATION = Situation("track", 8.3, 13.9, 1, 0, False, None, None)


def picture(time_s: float = 0.0, seed: int = 0) -> CameraImage:
    pixels = np.random.default_rng(seed).integers(0, 255, (HEIGHT, WIDTH, 3), np.uint8)
    return CameraImage("front", time_s, pixels)


@cache
def sunshine(manoeuvre: ManoeuvreName) -> CameraImage:
    """What the front camera shows before a manoeuvre in fine weather."""
    pytest.importorskip("osqp")
    command = next(one for one in commands() if one.manoeuvre == manoeuvre)
    return MotionItem(command, "sunny", "std", 1).shown("on")[0]


class Sees(VlmEngine):
    """An engine that sees what it is told to, and keeps what it was given."""

    def __init__(self, weather: str = "sunny", style: str = "aggressive") -> None:
        self.about = {"version": "test", "figures": {"test": {"grade": 95.0, "lead": 36.0, "road": 91.0}}}
        self.saw = {"weather": weather, "grade": "light", "lead": "lead", "road": "straight", "style": style}
        self.given: list[dict[str, str]] = []

    def read(self, text: str, pixels: Any, given: Any) -> VlmReading:
        self.given.append(dict(given))
        values = {**self.saw, **{name: f"{name}=3" for name in GAINS}, **given}
        return VlmReading(values, CODEBOOK.matrix(values), {}, TEMPLATE.text(TEMPLATE.encode(values)), 10)


def ask(
    planner: VlmPlanner,
    *images: CameraImage,
    situation: Situation = SITUATION,
    history: History | None = None,
    wish: str = "Be quick.",
) -> Plan:
    request = PlanRequest(
        Instruction(wish), Context("", situation), SystemMessage(""), history or History(), images=images
    )
    return asyncio.run(planner.plan(request))


def test_a_sound_camera_leaves_everything_to_the_model() -> None:
    engine = Sees("rain")
    plan = ask(VlmPlanner(engine), picture())
    assert engine.given == [{"task": "left_turn", "recall": "none"}]
    assert isinstance(plan.policy, ActionMatrix) and not gain_box().outside(plan.policy)
    assert "light rain" in plan.scene and plan.scene in plan.thoughts.text
    assert "straight" in plan.scene and "vehicle" not in plan.scene  # what it sees badly it does not say
    assert isinstance(VlmPlanner(engine), Planner) and looks(VlmPlanner(engine)) and not looks(KeywordPlanner())


@pytest.mark.parametrize(
    ("images", "said"),
    [
        ((), "off"),
        ((CameraImage("front", 0.0, np.zeros((HEIGHT, WIDTH, 3), np.uint8)),), "black"),
        ((CameraImage("front", 0.0, np.full((HEIGHT, WIDTH, 3), 127, np.uint8)),), "blank"),
        ((picture(0.0), picture(1.0)), "frozen"),
    ],
)
def test_a_camera_that_fails_is_said_and_the_most_careful_gains_taken(
    images: tuple[CameraImage, ...], said: str
) -> None:
    engine = Sees()
    plan = ask(VlmPlanner(engine), *images)
    assert said in plan.scene and "most careful" in plan.thoughts.text
    (given,) = engine.given
    assert (given["style"], given["weather"], given["grade"]) == ("conservative", "snow", "heavy")


def test_a_picture_that_has_not_changed_since_the_last_wish_is_frozen() -> None:
    planner = VlmPlanner(Sees())
    assert "frozen" not in ask(planner, picture(0.0)).scene
    assert "frozen" in ask(planner, picture(5.0)).scene
    assert "frozen" not in ask(planner, picture(9.0, seed=1)).scene


@pytest.mark.parametrize(
    ("seen", "told", "taken"),
    [
        ("sunny", "heavy snow", "snow"),
        ("snow", "clear sky", "snow"),
        ("rain", "fog", "fog"),
        ("snow", "fog", "snow"),
        ("rain", "light rain, mist", None),
        ("night", "clear sky", None),
        ("sunny", "not known", None),
    ],
)
def test_of_camera_and_weather_service_the_worse_one_counts(seen: str, told: str, taken: str | None) -> None:
    engine = Sees(seen)
    plan = ask(VlmPlanner(engine), picture(), situation=replace(SITUATION, scene=(("weather", told),)))
    if taken is None:
        assert len(engine.given) == 1 and "otherwise" not in plan.scene
    else:
        assert engine.given[-1]["weather"] == taken and "weather service says otherwise" in plan.thoughts.text


@pytest.mark.parametrize(
    ("seen", "wish", "taken"),
    [
        ("sunny", "I'm late, but it is slippery.", "snow"),
        ("sunny", "Careful, there's ice on the road.", "snow"),
        ("night", "It's raining, take it easy.", "rain"),
        ("snow", "Be quick, it's a bit foggy.", None),  # the camera sees worse
        ("sunny", "Be quick, it's not slippery.", None),
        ("sunny", "There is no fog, go on.", None),
        ("sunny", "My ice cream's melting, hurry up.", None),
        ("sunny", "The train leaves at five.", None),
    ],
)
def test_of_the_camera_and_what_the_passenger_says_the_worse_counts(seen: str, wish: str, taken: str | None) -> None:
    engine = Sees(seen)
    plan = ask(VlmPlanner(engine), picture(), wish=wish)
    if taken is None:
        assert not any("weather" in given for given in engine.given) and "You say" not in plan.thoughts.text
    else:
        assert (engine.given[-1]["weather"], engine.given[-1]["grade"]) == (taken, "heavy")
        assert "You say that" in plan.scene and "the worse of the two" in plan.thoughts.text


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize(
    "manoeuvre, speed_mps, lanes", [("acceleration", 0.0, 1), ("lane_change", 13.9, 2), ("left_turn", 8.3, 1)]
)
def test_the_model_that_ships_is_more_careful_where_it_goes_by_what_was_said(
    style: str, manoeuvre: ManoeuvreName, speed_mps: float, lanes: int
) -> None:
    wishes = {"aggressive": "I'm late, hurry", "moderate": "Drive as usual", "conservative": "Very gently, please"}
    here = replace(SITUATION, speed_mps=speed_mps, lane_count=lanes)
    bare, said, served = (
        ask(VlmPlanner(shipped()), sunshine(manoeuvre), wish=wish, situation=replace(here, scene=scene))
        for wish, scene in (
            (f"{wishes[style]}.", ()),
            (f"{wishes[style]}, but it is slippery.", ()),
            (f"{wishes[style]}.", (("weather", "heavy snow"),)),
        )
    )
    assert isinstance(bare.policy, ActionMatrix) and "sunny" in bare.scene
    for careful in (said, served):
        assert isinstance(careful.policy, ActionMatrix) and care(careful.policy) > care(bare.policy) + 0.1


def test_of_camera_service_and_passenger_the_worst_counts() -> None:
    engine = Sees("sunny")
    plan = ask(
        VlmPlanner(engine),
        picture(),
        situation=replace(SITUATION, scene=(("weather", "light rain"),)),
        wish="Hurry, but mind the snow.",
    )
    assert engine.given[-1]["weather"] == "snow" and "the worst of all" in plan.thoughts.text


def item(said: Feedback, before: float = 0.0, similarity: float = 0.9, when: str = "2026-01-01") -> HistoryItem:
    settings = ((RECALL_SETTING, before),)
    return HistoryItem("t", when, "Be quick.", "", "track", "motion.gains", "", "", settings, (said,), "", similarity)


HARSH, TIMID, LIKED = Feedback("a", comfort=-1), Feedback("b", speed=1), Feedback("c", approval=1)


@pytest.mark.parametrize(
    ("items", "expected"),
    [
        ((), "none"),
        ((item(HARSH),), "gentler"),
        ((item(TIMID),), "brisker"),
        ((item(LIKED, before=-1.0),), "gentler"),  # what was liked is done again
        ((item(TIMID, before=-1.0),), "none"),
        ((item(HARSH, similarity=0.3),), "none"),  # another wish
        ((item(HARSH), item(TIMID, when="2026-02-01")), "brisker"),  # the newest counts
    ],
)
def test_what_was_said_of_such_a_wish_moves_the_gains(items: tuple[HistoryItem, ...], expected: str) -> None:
    engine = Sees()
    plan = ask(VlmPlanner(engine), picture(), history=History(items))
    assert engine.given[0]["recall"] == expected
    assert dict(plan.settings)[RECALL_SETTING] == {"gentler": -1.0, "none": 0.0, "brisker": 1.0}[expected]
    assert recalled(History(items)) in (0, 1, 2)


@pytest.mark.parametrize(
    ("seen", "items", "sign"),
    [
        ("sunny", (item(HARSH, similarity=0.2),), 1),  # another wish, the same person
        ("snow", (item(HARSH, similarity=0.2),), 1),
        ("sunny", (item(TIMID, similarity=-1.0), item(TIMID, similarity=-1.0)), -1),
        ("snow", (item(TIMID, similarity=-1.0), item(TIMID, similarity=-1.0)), 0),  # never bolder in bad weather
        ("sunny", (item(HARSH, similarity=0.2), item(TIMID, similarity=0.2)), 0),
        ("sunny", (item(LIKED, similarity=0.2),), 0),
    ],
)
def test_what_was_said_of_other_wishes_counts_for_less(seen: str, items: tuple[HistoryItem, ...], sign: int) -> None:
    plain, tasted = (ask(VlmPlanner(Sees(seen)), picture(), history=History(history)) for history in ((), items))
    assert isinstance(plain.policy, ActionMatrix) and isinstance(tasted.policy, ActionMatrix)
    more = care(tasted.policy) - care(plain.policy)
    assert not gain_box().outside(tasted.policy)
    assert (more > 0.02, more < -0.02) == (sign > 0, sign < 0)
    assert abs(more - dict(tasted.settings)[TASTE_SETTING]) < 0.1
    assert bool(sign) == ("your words alone" in tasted.thoughts.text)


def test_the_more_often_it_is_said_the_farther_gains_move_and_less_for_other_wishes() -> None:
    once, often = (taste_of([JudgedDrive(-1, 0.6, 0.0, 1.0)] * count) for count in (1, 4))
    other = taste_of([JudgedDrive(-1, 0.6, 0.0, 0.3)])
    assert 0.0 < other < once < often < 0.4
    assert taste_of([JudgedDrive(1, 0.6, 0.0, 1.0)]) == pytest.approx(-once)
    assert taste_of([]) == 0.0
    gains = ActionMatrix((0.45, 0.03, 0.04), (11.0, 27.0, 100.0))
    assert care(moved(gains, 0.1)) == pytest.approx(care(gains) + 0.1, abs=0.02)
    assert moved(gains, 0.0) == gains


def test_the_manoeuvre_is_read_off_speed_and_lanes() -> None:
    assert task_of(replace(SITUATION, speed_mps=0.0)) == "acceleration"
    assert task_of(replace(SITUATION, lane_count=2)) == "lane_change"
    assert task_of(SITUATION) == "left_turn"


def test_an_empty_wish_is_refused() -> None:
    with pytest.raises(InstructionError):
        asyncio.run(VlmPlanner(Sees()).plan(PlanRequest(Instruction(" "), Context("", SITUATION), SystemMessage(""))))


def test_the_codebook_stays_inside_the_certified_box_and_gives_its_values_back() -> None:
    for level in (0, 7, LEVELS - 1):
        policy = CODEBOOK.matrix({name: f"{name}={level}" for name in GAINS})
        assert not gain_box().outside(policy)
        assert CODEBOOK.tokens((*policy.pid, *policy.mpc)) == {name: f"{name}={level}" for name in GAINS}


def test_pictures_of_any_size_are_brought_down_and_sound_ones_have_no_fault() -> None:
    large = np.repeat(np.repeat(picture().pixels(), 4, axis=0), 4, axis=1)
    assert (small(large) == picture().pixels()).all()
    assert camera_fault((picture(),)) == ""


def test_a_folder_without_a_model_is_refused(tmp_path: Any) -> None:
    with pytest.raises(DataError, match="model train vlm"):
        VlmPlanner.from_spec(str(tmp_path))
