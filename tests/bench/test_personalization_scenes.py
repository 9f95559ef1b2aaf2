"""The scenes show what their task needs, and their drives can be felt."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chauffeur.bench.personalization.ride import ride_policy
from chauffeur.bench.personalization.scenes import DRIVE_S, GROUND_OF, TASKS, Task, scenes_of
from chauffeur.concept import Limits, Observation, Parameters
from chauffeur.driving.episode import make_world


def _first(task: Task) -> list[Observation]:
    return [make_world(scene).reset(scene) for scene in scenes_of(task)]


def _near(shot: Observation, lane: int, behind_m: float, ahead_m: float) -> bool:
    return any(
        one.lane is not None and shot.road[one.lane].index == lane and -behind_m < one.x_m - shot.ego.x_m < ahead_m
        for one in shot.others
    )


@pytest.mark.parametrize("task", TASKS)
def test_no_scene_begins_in_trouble(task: Task) -> None:
    scenes = scenes_of(task)
    assert len({scene.id for scene in scenes}) == len(scenes) >= 4
    for shot in _first(task):
        assert not shot.ended
        assert not shot.ego.crashed
        assert shot.kind == GROUND_OF[task]
        if shot.kind == "highway" and shot.front is not None:
            assert shot.front.distance_m > 42.0  # the gap that cruise control keeps at these speeds


def test_there_is_somebody_slower_to_pass_and_a_lane_to_pass_in() -> None:
    for shot in _first("overtake"):
        assert shot.front is not None
        assert shot.front.speed_mps < 0.86 * 31.3
        assert not _near(shot, 0, 80.0, 120.0)


def test_there_is_somebody_to_follow_and_room_on_the_right() -> None:
    assert all(shot.front is not None and shot.front.distance_m < 50.0 for shot in _first("follow"))
    for shot in _first("right_lane"):
        assert shot.ego.lane is not None
        assert shot.road[shot.ego.lane].index == 0
        assert not _near(shot, 1, 60.0, 90.0)


def test_a_drive_is_traced_as_it_was_driven() -> None:
    scene = scenes_of("yield")[0]
    trace = ride_policy(Parameters(8.0, 12.0, 2.0, 0, "straight"), "yield", scene, Limits())
    assert trace.seconds <= DRIVE_S["yield"]
    assert trace.limit_mps == 10.0
    assert trace.speed[0] == pytest.approx(10.0)
    assert (trace.speed < 0.2).any()  # it stood at the sign
    assert trace.across[-1]
    assert trace.crossing.any()
    assert trace.encroachment
    assert all(missed >= 1.5 for _, missed in trace.encroachment)
    assert trace.statistics().speed_variance == pytest.approx(float(np.var(trace.speed)))
    assert not math.isfinite(float(trace.gap_m.min()))
    assert ride_policy(Parameters(8.0, 12.0, 2.0, 0, "straight"), "yield", scene, Limits()) is trace


def test_the_walk_from_a_spot_is_measured_from_the_best_one() -> None:
    scene = scenes_of("park")[0]
    trace = ride_policy(Parameters(3.5, 4.0, 1.0, 0, "nearest"), "park", scene, Limits())
    assert trace.parked
    assert trace.walk_m["nearest"] == 0.0
    assert trace.walk_m["stadium"] > 5.0
