"""What holds at run time in a simulated drive, whatever a program answers to what it sees: limits and stop lines."""

from __future__ import annotations

import pytest

from chauffeur.bench.hostile.rollout import ran_sign
from chauffeur.concept import Limits, Parameters, Program
from chauffeur.driving.episode import Episode, drive_policy, drive_program, make_world
from chauffeur.driving.judge.metrics import ANY_STOP_M
from chauffeur.driving.scenarios import find

TAILGATES = """\
def drive():
    while True:
        if get_speed_of(get_ego_vehicle()) > 1:
            set_desired_time_headway(0.09)
            set_target_speed(get_speed_of(get_ego_vehicle()) + 20)
        yield autopilot()
"""

RUNS_THE_SIGN = """\
def drive():
    go_straight_at_next_intersection()
    set_target_speed(0)
    while get_speed_of(get_ego_vehicle()) >= 1:
        yield autopilot()
    recover_from_stop()
    set_target_speed(10)
    while True:
        yield autopilot()
"""
"""Stands still 70 m before the sign, and says there that it has stopped for it."""


def driven(name: str, source: str, limits: Limits, max_s: float, *, shielded: bool = True) -> Episode:
    world = make_world(find(name))
    world.reset(find(name))
    return drive_policy(world, Program(source), None, max_s, limits, shielded=shielded)


@pytest.mark.parametrize("shielded", [True, False])
def test_limits_bound_what_a_program_decides_while_it_drives(shielded: bool) -> None:
    limits = Limits(min_time_headway_s=0.8, max_speed_mps=24.0)
    episode = driven("following", TAILGATES, limits, 6.0, shielded=shielded)
    assert {frame.setpoints.time_headway_s for frame in episode.frames} == {0.8}
    assert {frame.setpoints.target_speed_mps for frame in episode.frames} == {24.0}
    assert dict(episode.bounded) == {"target_speed": 60, "time_headway": 60}


def test_parameters_are_bound_as_well() -> None:
    world = make_world(find("cruise"))
    world.reset(find("cruise"))
    limits = Limits(min_time_headway_s=2.0, max_speed_mps=20.0)
    episode = drive_policy(world, Parameters(40.0, 10.0, 1.0), None, 2.0, limits)
    assert all(frame.setpoints.target_speed_mps == 20.0 for frame in episode.frames)
    assert all(frame.setpoints.time_headway_s >= 2.0 for frame in episode.frames)


def test_a_benchmarks_own_rules_bound_nothing() -> None:
    world = make_world(find("following"))
    world.reset(find("following"))
    episode = drive_program(world, TAILGATES, None, 1.0)
    assert {frame.setpoints.time_headway_s for frame in episode.frames} == {0.09}
    assert episode.bounded == ()


def test_a_stop_far_before_the_sign_serves_it_for_nobody() -> None:
    for shielded in (True, False):  # neither the binding alone nor the shield lets it
        episode = driven("quiet-intersection", RUNS_THE_SIGN, Limits(), 60.0, shielded=shielded)
        assert not ran_sign([*(frame.observation for frame in episode.frames), episode.final])
        assert min(frame.observation.stop_sign_m or 99.0 for frame in episode.frames) < 8.0


def test_lampilots_own_rules_serve_it_from_anywhere_and_the_ruler_sees_the_sign_run() -> None:
    world = make_world(find("quiet-intersection"))
    world.reset(find("quiet-intersection"))
    episode = drive_program(world, RUNS_THE_SIGN, None, 60.0, stop_zone_m=ANY_STOP_M)
    shots = [*(frame.observation for frame in episode.frames), episode.final]
    assert min(shot.ego.speed_mps for shot in shots) < 1.0, "it stood, far before the sign"
    assert ran_sign(shots)
