"""The parking-lot world: contract, replay, who is in it, and what ends a trip."""

from __future__ import annotations

import math

import pytest

from chauffeur.concept import Command, Observation, Scenario, ScenarioError, Setpoints
from chauffeur.concept.units import MPS_PER_KMH
from chauffeur.driving.actuate import actuate
from chauffeur.worlds.base import EGO
from chauffeur.worlds.parking import BUILT_IN, ParkingWorld, overlap
from chauffeur.worlds.parking.actors import LotWalker
from chauffeur.worlds.parking.world import CHASSIS, DT_S, STEERING_RATE


def _lot(seed: int = 3, **config: object) -> Scenario:
    return Scenario("lot", "parking", dict(config), seed)


def _started(seed: int = 3, **config: object) -> ParkingWorld:
    world = ParkingWorld()
    world.reset(_lot(seed, **config))
    return world


def _drive(world: ParkingWorld, setpoints: Setpoints, periods: int) -> list[Observation]:
    shots: list[Observation] = []
    driver = world.driver()
    for _ in range(periods):
        if world.ended:
            break
        actuate(world, None, driver.command(driver.settle(setpoints)), None, None)
        shots.append(world.observe())
    return shots


@pytest.mark.parametrize("scenario", BUILT_IN, ids=lambda scenario: scenario.id)
def test_its_own_driver_parks(scenario: Scenario) -> None:
    world = ParkingWorld()
    world.reset(scenario)
    spot = world.spot(scenario.goal["place"])
    shots = _drive(world, Setpoints(target_speed_mps=3.5, target_lane=spot.lane), 700)
    while world.parked() is None and not world.ended:
        shots += _drive(world, Setpoints(target_speed_mps=3.5, target_lane=spot.lane), 10)
    assert world.parked() == spot.name
    assert not any(shot.ego.crashed or shot.off_road for shot in shots)
    assert shots[-1].ego.lane == spot.lane


def test_another_seed_is_another_lot() -> None:
    assert _started(11).observe().others != _started(12).observe().others


def test_a_copy_goes_its_own_way() -> None:
    world = _started(cars=2, walkers=2)
    setpoints = Setpoints(target_speed_mps=3.0, target_lane=world.spot("stadium").lane)
    _drive(world, setpoints, 20)
    twin = world.copy()
    assert twin.observe() == world.observe()
    before = world.observe()
    _drive(twin, setpoints, 20)
    assert world.observe() == before
    again = world.copy()
    _drive(again, setpoints, 20)
    assert again.observe() == twin.observe()


@pytest.mark.parametrize(
    ("config", "says"),
    [
        ({"aisles": 0}, "aisles"),
        ({"taken": 1.0}, "taken"),
        ({"colour": "red"}, "colour"),
        ({"free": ["A1", "Q7"]}, "Q7 free; there is no such spot"),
    ],
)
def test_a_bad_lot_is_refused_with_its_field(config: dict[str, object], says: str) -> None:
    with pytest.raises(ScenarioError, match=says):
        ParkingWorld().reset(_lot(**config))


def test_who_is_there_is_as_configured() -> None:
    world = _started(5, taken=0.5, cars=2, walkers=3, free=("A1", "B2"))
    others = world.observe().others
    parked = [o for o in others if o.kind == "car" and o.speed_mps == 0.0]
    assert len(parked) == 24
    assert len(others) == 24 + 2 + 3
    assert sum(o.kind == "obstacle" for o in others) == 3
    assert [o.id for o in others] == list(range(1, 30))
    assert world.spot("A1").name == "A1"
    assert world.spot("B2").name == "B2"
    taken = {o.lane for o in parked}
    for view in world.observe().road.lanes:
        assert view.closed == (view.id in taken)
    for i, one in enumerate(others):
        for other in others[:i]:
            assert not overlap(one.box, other.box)


def test_the_ego_is_a_bicycle() -> None:
    world = _started(cars=0, walkers=0, ego_speed=2.0)
    before = world.observe().ego
    applied = actuate(world, None, Command(0.0, 0.05), None, None).applied
    assert applied == Command(0.0, 0.05)
    for _ in range(4):
        actuate(world, None, Command(0.0, 0.05), None, None)
    after = world.observe().ego
    assert after.heading_rad == pytest.approx(5 * 0.2 * math.tan(0.05) / CHASSIS.wheelbase_m)
    assert math.dist((before.x_m, before.y_m), (after.x_m, after.y_m)) == pytest.approx(1.0, rel=0.01)
    assert actuate(world, None, Command(99.0, 9.0), None, None).applied.acceleration_mps2 == pytest.approx(3.0)
    turned = actuate(world, None, Command(0.0, -9.0), None, None).applied.steering_rad
    assert turned == pytest.approx(0.05 + STEERING_RATE * DT_S - STEERING_RATE * DT_S)
    for _ in range(20):
        stopped = actuate(world, None, Command(-99.0, 0.0), None, None)
    assert world.observe().ego.speed_mps == 0.0, "it brakes to a stand and does not reverse"
    assert stopped.applied.acceleration_mps2 == 0.0


def test_driving_into_a_parked_car_is_a_collision() -> None:
    world = _started(1, taken=0.95, cars=0, walkers=0)
    while not world.ended:  # round the first corner too widely, and straight on
        ego = world.observe().ego
        turns = ego.x_m > 0.0 and ego.heading_rad > -math.radians(70.0)
        actuate(world, None, Command(0.3, -0.5 if turns else 0.0), None, None)
    final = world.observe()
    assert final.ego.crashed
    hit = [other for other in final.others if other.crashed]
    assert len(hit) == 1
    assert overlap(final.ego.box.grown(0.3), hit[0].box)


def test_leaving_the_pavement_ends_the_trip() -> None:
    world = _started(cars=0, walkers=0)
    while not world.ended:
        actuate(world, None, Command(1.0, 0.3), None, None)
    assert world.observe().off_road
    assert not world.observe().ego.crashed


def test_out_of_time() -> None:
    world = _started(duration_s=1.0)
    assert len(_drive(world, Setpoints(target_speed_mps=0.0), 50)) == 10
    assert world.ended


def test_the_other_car_leaves_and_is_gone() -> None:
    world = _started(2, cars=1, walkers=0, aisles=1, spots_a_row=2)
    number = world.observe().others[-1].id
    _drive(world, Setpoints(target_speed_mps=0.0), 500)
    with pytest.raises(KeyError):
        world.perception().vehicle(number)


def test_nobody_drives_or_walks_into_a_car_that_stands() -> None:
    for seed in range(3):
        world = _started(seed, cars=2, walkers=3)
        shots = _drive(world, Setpoints(target_speed_mps=2.0), 60) + _drive(world, Setpoints(target_speed_mps=0.0), 120)
        assert not shots[-1].ego.crashed


def test_a_walker_goes_to_and_fro_and_waits_for_cars() -> None:
    walker = LotWalker(9, (0.0, 0.0), (6.0, 0.0), pause_s=2.0)
    seen = []
    for _ in range(160):
        walker.decide([], DT_S)
        walker.move(DT_S)
        seen.append(walker.state().x_m)
    assert max(seen) == 6.0
    assert min(seen[60:]) == 0.0
    car = _started(cars=0, walkers=0).observe().ego
    shy = LotWalker(9, (car.x_m, car.y_m - 4.0), (car.x_m, car.y_m + 4.0), pause_s=2.0)
    for _ in range(100):
        shy.decide([car], DT_S)
        shy.move(DT_S)
    assert not shy.walks
    assert not overlap(car.box, shy.state().box)


def test_a_walker_does_not_brush_past_a_car() -> None:
    """Along its side and away from its middle, but at a slant that leads into its corner."""
    car = _started(cars=0, walkers=0).observe().ego
    walker = LotWalker(9, (car.x_m + 0.5, car.y_m - 1.5), (car.x_m + 3.0, car.y_m - 0.9), pause_s=2.0)
    for _ in range(25):
        walker.decide([car], DT_S)
        walker.move(DT_S)
        assert not overlap(car.box, walker.state().box)
    assert walker.way_m > 0.1


def test_the_questions_of_the_driving_apis_have_answers() -> None:
    world = _started(2, cars=1, walkers=1)
    perception, shot = world.perception(), world.observe()
    ahead = next(o for o in shot.others if o.speed_mps > 0.0 and o.kind == "car")
    lane = perception.lane_of(EGO)
    assert shot.front is not None
    assert shot.front.vehicle == ahead.id
    assert perception.front_blocker(frozenset()) == ahead.id
    assert perception.neighbours(lane) == (ahead.id, None)
    assert perception.distance_along(EGO, ahead.id) == pytest.approx(shot.front.distance_m)
    assert perception.distance_along(ahead.id, EGO) == pytest.approx(-shot.front.distance_m)
    assert perception.has_lane(lane)
    assert not perception.has_lane("x-y:0")
    assert perception.speed_limit(lane) == pytest.approx(15.0 * MPS_PER_KMH)
    assert perception.adjacent_lane(lane, 1) is None
    assert perception.stop_sign_ahead(frozenset()) is None
    assert perception.cross_traffic_lanes(True) == ()
    assert perception.idm_entering(EGO, ahead.id, 1.5) < perception.idm_entering(EGO, ahead.id, 0.5)
    with pytest.raises(KeyError):
        perception.vehicle(999)
