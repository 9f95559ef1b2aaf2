"""C from cameras: it says what the model saw, of the map and the instruments what they say, and nothing else."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from chauffeur.bench.nuplanqa.scenes.staging import stage
from chauffeur.camera import CameraImages, front_rig
from chauffeur.concept import CameraImage, Observation
from chauffeur.describe import describe_with_traffic
from chauffeur.describe.road import own_direction
from chauffeur.describe.vision import AGO_S, CameraDescriptor, SceneAnswers, describe_seen, rewound, seen
from chauffeur.driving.scenarios import find
from chauffeur.worlds.highway import HighwayWorld


@pytest.fixture(scope="module")
def road() -> Observation:
    return HighwayWorld().reset(find("overtake"))


def test_who_is_ahead_is_who_was_seen(road: Observation) -> None:
    assert road.front is not None  # the world has a lead vehicle, elsewhere than the cameras say
    context = describe_seen(road, SceneAnswers(ahead="truck", ahead_m=41.0, ahead_faster_mps=-3.0))
    assert "41.0 m away" in context.text
    assert context.situation.front is not None
    assert context.situation.front.speed_mps == pytest.approx(road.ego.speed_mps - 3.0)
    nobody = describe_seen(road, SceneAnswers())
    assert "There is no car ahead of me" in nobody.text and nobody.situation.front is None


def test_lane_limit_and_speed_stay_those_of_map_and_instruments(road: Observation) -> None:
    told, true = describe_seen(road, SceneAnswers()).situation, describe_with_traffic(road).situation
    assert replace(told, front=None) == replace(true, front=None)


@pytest.mark.parametrize(("side", "word"), [(-1, "left"), (1, "right")])
def test_who_is_beside_is_in_the_lane_on_that_side(road: Observation, side: int, word: str) -> None:
    lanes = own_direction(road)
    own = 1 if side < 0 else 0
    inside = replace(road, ego=replace(road.ego, lane=lanes[own].id))
    answers = SceneAnswers(left="bus") if side < 0 else SceneAnswers(right="bus")
    (bus,) = seen(inside, answers).others
    assert bus.kind == "bus" and bus.lane == lanes[own + side].id
    assert abs(lanes[own + side].centre.project(bus.x_m, bus.y_m)[1]) < 0.1
    assert f"In the lane on my {word} a car is right beside me" in describe_seen(inside, answers).text


def test_nobody_is_put_where_there_is_no_lane(road: Observation) -> None:
    leftmost = replace(road, ego=replace(road.ego, lane=own_direction(road)[0].id))
    assert seen(leftmost, SceneAnswers(left="car")).others == ()


def test_a_light_shows_what_was_seen_and_none_is_told_where_none_was() -> None:
    for number in range(200):
        scene = stage(f"{number:016x}", np.random.default_rng(number))
        if scene.light == "green":
            break
    now = replace(scene.now, kind="town", ego=replace(scene.now.ego, lane="own.0"))
    assert "is red." in describe_seen(now, SceneAnswers(light="red", sky="foggy day")).text
    assert "traffic light" not in describe_seen(now, SceneAnswers()).text
    assert "Somebody is on foot" in describe_seen(now, SceneAnswers(people_ahead_m=(12.0,))).text
    assert ("weather", "It is a foggy day, by the cameras.") in describe_seen(
        now, SceneAnswers(sky="foggy day")
    ).situation.scene


def test_a_moment_before_everybody_was_where_their_speed_says(road: Observation) -> None:
    before = rewound(road, 2.0)
    for then, now in zip((before.ego, *before.others), (road.ego, *road.others), strict=True):
        assert np.hypot(now.x_m - then.x_m, now.y_m - then.y_m) == pytest.approx(2.0 * now.speed_mps)


class _Painter:
    engine = "test"

    def __init__(self) -> None:
        self.taken: list[Observation] = []

    def render(self, observation: Observation, rig: Any, conditions: Any, seed: int = 0, **_: Any) -> CameraImages:
        self.taken.append(observation)
        pixels = np.full((4, 4, 3), len(self.taken), np.uint8)
        images = tuple(CameraImage(camera.name, observation.time_s, pixels) for camera in rig.cameras)
        return CameraImages(images, (), rig.cameras, conditions, seed, "default", "test")

    def close(self) -> None: ...


class _Reader:
    rig = front_rig(8, 8)

    def __init__(self) -> None:
        self.asked: list[tuple[int, int, float]] = []

    def read(self, now: Any, before: Any, moved: tuple[float, float, float]) -> SceneAnswers:
        self.asked.append((int(now["front"][0, 0, 0]), int(before["front"][0, 0, 0]), moved[0]))
        return SceneAnswers(ahead="car", ahead_m=33.0)


def test_the_descriptor_shows_the_model_now_and_before_and_says_what_it_answers(road: Observation) -> None:
    painter, reader = _Painter(), _Reader()
    told: list[SceneAnswers] = []
    descriptor = CameraDescriptor(reader, painter, told=told.append)
    assert "33.0 m away" in descriptor(road).text
    assert painter.taken == [road, rewound(road, AGO_S)]
    assert reader.asked == [(1, 2, pytest.approx(AGO_S * road.ego.speed_mps))]
    assert told == [SceneAnswers(ahead="car", ahead_m=33.0)]
