"""Open roads: what is drawn is what is described, in any of the car's places, and a trajectory is driven to its end."""

from __future__ import annotations

import math
from dataclasses import asdict
from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("vehiclemodels")

from chauffeur.concept import Limits, Observation, Scenario, ScenarioError, Street, Trajectory
from chauffeur.describe.dispatch import describe
from chauffeur.describe.street import street_ahead
from chauffeur.driving.episode import drive_policy
from chauffeur.geometry import Pose
from chauffeur.worlds.track import BUILT_IN, StreetReferee, TrackWorld, end_of, peak_of
from chauffeur.worlds.track.street import draw_street, street_of

OPEN = {one.id: one for one in BUILT_IN}["open-road"]


def spans(street: Street) -> tuple[list[tuple[object, ...]], list[float]]:
    """What there is, and all its stations."""
    ways = sorted(street.ways, key=lambda way: way.turn)
    marks = sorted((one for one in street.marks if one.start_m < 48.0), key=lambda one: (one.kind, one.start_m))
    found: list[tuple[object, ...]] = [(way.turn, way.bend_m is None, way.radius_m is None) for way in ways]
    found += [(one.kind, sorted(one.ways)) for one in marks]
    stations = [m for way in ways for m in (*(way.bend_m or ()), way.kerb_m or 0.0)]
    return found, stations + [m for one in marks for m in (one.start_m, one.end_m)]


def test_what_is_drawn_is_what_is_described() -> None:
    rng = np.random.default_rng(5)
    for _ in range(25):
        config = draw_street(rng)
        shown = TrackWorld().reset(Scenario("drawn", "track", {"street": asdict(config)}, 1))
        street = describe(shown).street
        assert street is not None
        wanted = street_of(config)
        assert spans(street)[0] == spans(wanted)[0]
        assert spans(street)[1] == pytest.approx(spans(wanted)[1], abs=0.1)
        assert street.speed_mps == pytest.approx(wanted.speed_mps)
        for way in street.ways:
            assert math.hypot(*way.path_m[0]) < 0.01
            assert max(math.dist(a, b) for a, b in pairwise(way.path_m)) < 60.0


def test_streets_are_told_in_words_and_set_no_manoeuvre() -> None:
    world = TrackWorld()
    text = describe(world.reset(OPEN)).text
    assert "At the junction 9 m ahead I can go left or straight on or right." in text
    assert "A crosswalk is 34 m ahead, on the road to the left." in text
    with pytest.raises(ScenarioError, match="no manoeuvre"):
        _ = world.manoeuvre
    with pytest.raises(ScenarioError, match="junction_m"):
        TrackWorld().reset(Scenario("odd", "track", {"street": {"junction_m": 2.0}}, 1))


def test_the_kerb_is_beside_the_lane_that_leads_on() -> None:
    world = TrackWorld()
    shown = world.reset(OPEN)
    from dataclasses import replace

    moved = replace(shown, ego=replace(shown.ego, y_m=-2.8, lane="here_kerb"))
    street = street_ahead(moved)
    assert street is not None
    assert street.ways[0].path_m[0] == pytest.approx((0.0, 2.8), abs=0.1)
    back = replace(shown, ego=replace(shown.ego, lane="crosswalk_0"))
    assert street_ahead(back) is None


def test_a_trajectory_is_driven_to_its_end_and_judged() -> None:
    pytest.importorskip("osqp")
    points = tuple((float(x), 0.0) for x in np.minimum(np.cumsum([0.3, 0.8, 1.2, 1.5, 1.2, 0.8, 0.4, 0.0]), 6.2))
    policy = Trajectory(points, 0.5)
    world = TrackWorld()
    start: Observation = world.reset(OPEN)
    end = end_of(policy, Pose(start.ego.x_m, start.ego.y_m, start.ego.heading_rad))
    assert (end.x_m, end.heading_rad) == pytest.approx((start.ego.x_m + 6.2, 0.0))
    assert peak_of(policy) == pytest.approx(3.0)
    referee = StreetReferee(world, end)
    episode = drive_policy(world, policy, referee, 30.0, Limits())
    assert episode.outcome == "success"
    assert max(abs(frame.observation.ego.acceleration_mps2) for frame in episode.frames) < 3.5
    assert not StreetReferee(world, end.ahead(5.0)).success
