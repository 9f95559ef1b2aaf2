"""`Parameters` driven in a parking lot."""

from __future__ import annotations

import math
import re
import runpy
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chauffeur.concept import Parameters, Scenario, ScenarioError
from chauffeur.driving.episode import Episode, drive_executed
from chauffeur.safety.shield import shield_for
from chauffeur.worlds.parking import PLACES, ParkingReferee, ParkingWorld


def _lot(seed: int, **config: object) -> ParkingWorld:
    world = ParkingWorld()
    world.reset(Scenario("lot", "parking", dict(config), seed))
    return world


def _park(world: ParkingWorld, policy: Parameters, place: str, *, shielded: bool = True) -> Episode:
    shield = shield_for(world) if shielded else None
    referee = ParkingReferee(world, world.spot(place))
    return drive_executed(world, replace(policy, route=place), referee, max_s=120.0, shield=shield)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize(
    "policy", [Parameters(3.0, 4.0, 1.0), Parameters(4.2, 12.0, 2.0), Parameters(2.0, 1.0, 0.0)], ids=str
)
def test_it_parks_where_it_was_meant_to(place: str, policy: Parameters) -> None:
    world = _lot(7, cars=1, walkers=2)
    spot = world.spot(place)
    episode = _park(world, policy, place)
    assert episode.outcome == "success"
    assert episode.success
    values = {metric.id: metric.value for metric in episode.metrics}
    assert values["parking-across-v1"] < 0.3
    assert values["parking-along-v1"] < 0.05
    assert values["parking-straight-v1"] < 5.0
    assert episode.frames[-1].setpoints.target_lane == spot.lane
    assert world.parked() == spot.name


def test_without_a_place_it_drives_on_and_stands_before_the_exit() -> None:
    world = _lot(3, aisles=1, spots_a_row=2, cars=0, walkers=0)
    episode = drive_executed(world, Parameters(4.0, 5.0, 1.0), max_s=80.0)
    ego = episode.final.ego
    assert ego.speed_mps < 0.05
    assert abs(math.sin(ego.heading_rad)) < 0.02
    assert ego.x_m - ego.length_m / 2.0 == pytest.approx(-23.5, abs=0.1)
    assert not episode.final.off_road


def test_it_stops_for_somebody_who_crosses() -> None:
    """People cross at the head of the only aisle: for some of them the car slows down, and nobody is touched."""
    slowed = 0
    for seed in (1, 4, 6):
        world = _lot(seed, aisles=1, cars=0, walkers=3)
        episode = _park(world, Parameters(3.5, 4.0, 1.0), "exit", shielded=False)
        assert episode.outcome == "success"
        before = [frame.observation.ego.speed_mps for frame in episode.frames if frame.observation.ego.y_m > -9.0]
        slowed += min(before) < 1.0
    assert slowed


def test_the_target_speed_is_kept_to_and_the_lots_limit_as_well() -> None:
    for target, most in ((2.0, 2.05), (30.0, 15.0 / 3.6 + 1.05)):
        episode = _park(_lot(9, cars=0, walkers=0, ego_speed=2.0), Parameters(target, 4.0, 1.0), "stadium")
        assert max(frame.observation.ego.speed_mps for frame in episode.frames) <= most


def test_a_spot_that_is_taken_is_refused_before_the_car_moves() -> None:
    world = _lot(7)
    taken = next(o.lane for o in world.observe().others if o.lane is not None and o.speed_mps == 0.0)
    with pytest.raises(ScenarioError, match=f"{taken} is taken"):
        drive_executed(world, Parameters(3.0, 4.0, 1.0, route=taken), max_s=10.0)
    assert world.observe().tick == 0


def test_a_lane_wish_means_nothing_in_a_lot() -> None:
    episode = drive_executed(_lot(7, cars=0, walkers=0), Parameters(3.0, 4.0, 1.0, -1), max_s=5.0)
    assert abs(episode.final.ego.y_m) < 0.05


numbers = st.one_of(st.floats(), st.floats(0.0, 40.0), st.sampled_from([0.0, -1.0, 1e9, math.nan, math.inf]))


@given(st.integers(0, 99), numbers, numbers, numbers, st.sampled_from(PLACES))
@settings(max_examples=6, deadline=None)
def test_no_parameters_are_a_danger(seed: int, speed: float, ahead: float, ratio: float, place: str) -> None:
    world = _lot(seed, cars=seed % 3, walkers=seed % 4)
    referee = ParkingReferee(world, world.spot(place))
    episode = drive_executed(world, Parameters(speed, ahead, ratio, route=place), referee, max_s=25.0, record=False)
    assert not episode.final.ego.crashed
    assert not episode.final.off_road


def test_the_same_trip_twice() -> None:
    first, second = (_park(_lot(7, cars=2, walkers=3), Parameters(3.0, 4.0, 1.0), "nearest") for _ in range(2))
    assert first == second


def test_the_example_of_the_document_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (Path(__file__).resolve().parents[2] / "docs" / "parameters.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    (tmp_path / "example.py").write_text(block, encoding="utf-8")
    runpy.run_path(str(tmp_path / "example.py"))
    assert capsys.readouterr().out.startswith("success ")
