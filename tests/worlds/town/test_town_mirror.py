"""A town in another process: the same instants and answers, without a simulator."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace

import pytest

from chauffeur.concept import Command, DataError, Observation, Scenario, ScenarioError, Setpoints
from chauffeur.worlds.base import MirroredWorld, WorldMirror
from chauffeur.worlds.places import TownPlaces

pytest.importorskip("libsumo")
pytest.importorskip("sumo")

from chauffeur.worlds.town import TownMirror, TownWorld

GRIDFORD = Scenario("t", "town", {"town": "Gridford", "vehicles": 30, "people": 30}, 4)


@pytest.fixture
def world() -> Iterator[TownWorld]:
    world = TownWorld()
    world.reset(GRIDFORD)
    yield world
    world.close()


@pytest.fixture
def mirror() -> TownMirror:
    mirror = TownMirror()
    mirror.reset(GRIDFORD)
    return mirror


def step(world: TownWorld) -> None:
    driver = world.driver()
    world.step(driver.command(driver.settle(driver.initial_setpoints())))


def test_a_copy_sees_and_answers_as_the_town_does(world: TownWorld, mirror: TownMirror) -> None:
    assert isinstance(world, MirroredWorld)
    assert isinstance(mirror, WorldMirror)
    assert isinstance(mirror, TownPlaces)
    assert mirror.observe().ego.lane == world.observe().ego.lane
    for tick in range(500):
        if tick == 60:
            world.head_for("the station")
        if tick == 300:
            world.head_for("the church")
        if tick % 7 == 0:  # some instants are missed
            mirror.adopt(world.mirrored())
            assert mirror.observe() == world.observe()
            there, here = mirror.perception(), world.perception()
            assert there.gap_ahead() == here.gap_ahead()
            assert there.light_ahead() == here.light_ahead()
            assert there.junction_ahead() == here.junction_ahead()
            assert mirror.destination() == world.destination()
            assert there.place_ahead("church") == here.place_ahead("church")
            wish = world.driver().initial_setpoints()
            assert mirror.driver().settle(wish) == world.driver().settle(wish)
        step(world)
    left_m = [(end := world.destination()) and end.left_m]
    for _ in range(100):
        step(world)
    going = world.destination()
    assert going is not None and going.name == "St. Mary's Church"
    assert going.left_m < (left_m[0] or 0.0), "it comes nearer"
    world.leave()
    assert world.destination() is None


def test_a_copy_may_try_a_way_and_is_back_with_the_next_instant(world: TownWorld, mirror: TownMirror) -> None:
    mirror.adopt(world.mirrored())
    before = mirror.observe()
    mirror.head_for("the hospital")
    assert mirror.observe().route != before.route
    with pytest.raises(ScenarioError, match="no place"):
        mirror.head_for("the moon")
    mirror.adopt(world.mirrored())
    assert mirror.observe() == before == world.observe()


def test_an_instant_that_is_none_leaves_the_copy_as_it_was(world: TownWorld, mirror: TownMirror) -> None:
    step(world)
    good = world.mirrored()
    mirror.adopt(good)
    before = mirror.observe()
    own = world.observe().ego.lane
    assert own is not None
    for bad in (b"", b"x" * 40, good[:-9], good.replace(own.encode(), b"nowhere"), good.replace(b'"id":0', b'"id":7')):
        with pytest.raises(DataError):
            mirror.adopt(bad)
    assert mirror.observe() == before
    with pytest.raises(ScenarioError, match="not driven"):
        mirror.step(Command(0.0, 0.0))


def test_a_lane_change_looks_the_same_from_elsewhere(world: TownWorld, mirror: TownMirror) -> None:
    """The line that leads over is no lane's."""
    lane, beside = "3:0:-1", "3:0:-2"
    config = {"town": "Gridford", "vehicles": 0, "people": 0, "start": (lane, 8.0), "ego_speed": 8.0}
    for one in (world, mirror):
        one.reset(Scenario("t", "town", config, 4))
    driver, led = world.driver(), False
    for _ in range(80):
        world.step(driver.command(driver.settle(Setpoints(target_lane=beside))))
        mirror.adopt(world.mirrored())
        led |= driver.stretch.led is not None
        assert mirror.driver().course == driver.course
        assert mirror.driver().stretch.line.points_m == driver.stretch.line.points_m
    assert led


def test_a_full_town_fits_into_a_message(world: TownWorld) -> None:
    from chauffeur.worlds.town.instant import MOST_BYTES, TownInstant

    instant = TownInstant.decode(world.mirrored())
    crowd = [type(instant.ego)(10 + i, "car", float(i), 0.0, 0.1, 3.1, 4.6, 1.85, None) for i in range(2000)]
    full = replace(instant, others=tuple(crowd))
    payload = full.encode()
    assert len(payload) <= MOST_BYTES
    kept = TownInstant.decode(payload).others
    assert len(kept) > 100


def test_a_copy_needs_no_simulator() -> None:
    code = (
        "import sys; sys.modules['libsumo'] = None\n"
        "from chauffeur.concept import Scenario\nfrom chauffeur.worlds.town import TownMirror\n"
        f"seen = TownMirror().reset(Scenario('t', 'town', {dict(GRIDFORD.config)!r}, 4))\nprint(seen.kind)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "town"


def test_the_instant_is_an_observation(mirror: TownMirror) -> None:
    assert isinstance(mirror.observe(), Observation)
    assert mirror.observe().others == ()
