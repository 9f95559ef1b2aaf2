"""Road users that a scenario stages, and the colours of all: drawn by the seed, mirrored and painted."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import pytest

from chauffeur.camera.look import CameraLook
from chauffeur.camera.scene import SceneBuilder
from chauffeur.camera.solids import BLUE, RED
from chauffeur.camera.weather import Conditions
from chauffeur.concept import Observation, Scenario, ScenarioError, VehicleState
from chauffeur.concept.paint import PAINT_RGB, css_colour
from chauffeur.concept.utterance import Colour
from chauffeur.describe import describe

pytest.importorskip("libsumo")

from chauffeur.worlds.town import TownWorld
from chauffeur.worlds.town.colours import drawn_colour

PARKED = {"kind": "car", "colour": "silver", "ahead_m": 44.0, "left_m": -2.8}
BUS = {"kind": "bus", "colour": "red", "ahead_m": 18.0, "drives": True, "turns": ["right"]}
WALKS = {
    "kind": "pedestrian", "ahead_m": 40.0, "left_m": -4.0, "heading": "left", "speed_mps": 1.0, "after_s": 1.0,
    "for_m": 3.0,
}  # fmt: skip


@pytest.fixture
def world() -> Iterator[TownWorld]:
    one = TownWorld()
    yield one
    one.close()


def scenario(*stage: dict[str, Any], **config: Any) -> Scenario:
    base = {"town": "Gridford", "start": ["4:0:-2", 6.0], "vehicles": 0, "people": 0, "stage": list(stage)}
    return Scenario("s", "town", {**base, **config}, 1)


def driven(world: TownWorld, seconds: float) -> Observation:
    driver = world.driver()
    setpoints = driver.initial_setpoints()
    for _ in range(round(seconds / world.dt_s)):
        setpoints = driver.settle(setpoints)
        world.step(driver.command(setpoints))
    return world.observe()


def found(seen: Observation, number: int) -> VehicleState:
    return next(one for one in seen.others if one.id == number)


def test_they_stand_where_they_are_told_to(world: TownWorld) -> None:
    seen = world.reset(scenario(PARKED, WALKS))
    parked, walks = world.staged
    ego = seen.ego
    assert found(seen, parked).x_m - ego.x_m == pytest.approx(44.0, abs=0.3)
    assert found(seen, parked).y_m - ego.y_m == pytest.approx(-2.8, abs=0.3)
    assert found(seen, parked).colour == "silver"
    began = found(seen, walks)
    assert began.speed_mps == 0.0
    later = driven(world, 3.0)
    assert found(later, walks).y_m - began.y_m == pytest.approx(2.0, abs=0.2)
    assert found(later, walks).speed_mps == 1.0
    at_last = driven(world, 4.0)
    assert found(at_last, walks).y_m - began.y_m == pytest.approx(3.0, abs=0.1)
    assert found(at_last, walks).speed_mps == 0.0


def test_one_that_drives_keeps_to_the_lights_and_turns_as_told(world: TownWorld) -> None:
    seen = world.reset(scenario(BUS))
    (bus,) = world.staged
    began = found(seen, bus).heading_rad
    for _ in range(30):
        seen = driven(world, 1.0)
        if bus not in {one.id for one in seen.others} or abs(found(seen, bus).heading_rad - began) > 1.2:
            break
    assert found(seen, bus).heading_rad - began == pytest.approx(-math.pi / 2.0, abs=0.4)


def test_round_a_corner_is_told_by_its_turns(world: TownWorld) -> None:
    seen = world.reset(scenario({**PARKED, "ahead_m": 100.0, "way": ["right"]}))
    car = found(seen, world.staged[0])
    assert car.y_m < seen.ego.y_m - 15.0


@pytest.mark.parametrize(
    "actor", [{**PARKED, "kind": "dragon"}, {**PARKED, "colour": "tartan"}, {**BUS, "left_m": 25.0, "ahead_m": 40.0}]
)
def test_what_cannot_be_staged_is_refused(world: TownWorld, actor: dict[str, Any]) -> None:
    with pytest.raises(ScenarioError):
        world.reset(scenario({**actor, "drives": actor["kind"] == "bus"}))


def test_colours_are_the_seeds_and_change_nothing_else(world: TownWorld) -> None:
    seen: list[dict[int, Colour | None]] = []
    for seed in (1, 1, 2):
        world.reset(scenario(vehicles=30, people=10), seed)
        seen.append({one.id: one.colour for one in driven(world, 2.0).others})
    assert seen[0] == seen[1]
    assert seen[0] != seen[2]
    assert None not in seen[0].values()


def test_every_colour_can_be_painted_and_drawn() -> None:
    drawn = {drawn_colour(1, number, kind) for number in range(600) for kind in ("car", "bus", "pedestrian")}
    assert len(drawn) > 8
    assert {one for one in drawn if one is not None} <= set(PAINT_RGB)
    assert drawn_colour(1, 1, "static") is None
    assert all(len(css_colour(one)) == 7 for one in PAINT_RGB)


def test_a_copy_in_another_process_shows_the_same_colours(world: TownWorld) -> None:
    seen = world.reset(scenario(PARKED, WALKS))
    mirror = world.mirror()
    mirror.reset(scenario(PARKED, WALKS))
    mirror.adopt(world.mirrored())
    assert [one.colour for one in mirror.observe().others] == [one.colour for one in seen.others]


def test_the_camera_paints_a_car_in_its_colour(world: TownWorld) -> None:
    world.reset(scenario({**PARKED, "colour": "red"}, {**PARKED, "colour": "blue", "ahead_m": 30.0}))
    scene = SceneBuilder().scene(world.observe(), Conditions(), CameraLook(), 1)
    paints = {tuple(round(float(part), 3) for part in row[RED : BLUE + 1]) for row in scene.movable.rows}
    for colour, there in (("red", True), ("blue", True), ("green", False), ("yellow", False)):
        assert (tuple(round(part, 3) for part in PAINT_RGB[colour]) in paints) == there  # type: ignore[index]


def test_the_situation_tells_road_users_by_their_numbers(world: TownWorld) -> None:
    seen = world.reset(scenario(PARKED, BUS))
    parked, bus = world.staged
    text = describe(seen).text
    assert f"{parked} parked silver car, 44 m" in text
    assert f"{bus} red bus, 18 m" in text
