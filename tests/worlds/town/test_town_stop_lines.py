"""The driver of towns at a stop line some metres before its junction, on a street of our own."""

from __future__ import annotations

import pytest

from chauffeur.concept import Observation, Setpoints, Signal, VehicleState
from chauffeur.control.kinematic_bicycle import LINCOLN_MKZ, BicycleState, advanced
from chauffeur.geometry import Lane, Polyline, Pose, RoadGraph
from chauffeur.worlds.town.driver import TownDriver

DT = 0.05
ROAD = RoadGraph(
    (
        Lane("a", Polyline.of([(0.0, 0.0), (80.0, 0.0)]), 3.5, 14.0, road="a", successors=("j",)),
        Lane("j", Polyline.of([(80.0, 0.0), (100.0, 0.0)]), 3.5, 14.0, road="j", junction="J", successors=("b",)),
        Lane("k", Polyline.of([(90.0, -10.0), (90.0, 10.0)]), 3.5, 14.0, road="k", junction="J"),
        Lane("b", Polyline.of([(100.0, 0.0), (300.0, 0.0)]), 3.5, 14.0, road="b"),
    )
)


def seen(state: BicycleState, tick: int, signal: Signal, *others: VehicleState) -> Observation:
    middle = state.middle(LINCOLN_MKZ)
    lane = "a" if middle.x_m < 80.0 else "j" if middle.x_m < 100.0 else "b"
    size = LINCOLN_MKZ.length_m, LINCOLN_MKZ.width_m
    ego = VehicleState(0, "car", middle.x_m, middle.y_m, middle.heading_rad, state.speed_mps, *size, lane)
    return Observation(tick * DT, tick, "town", ego, others, (), ROAD, None, None, False, False, signals=(signal,))


@pytest.mark.parametrize("line_m", [73.6, 74.2, 74.9])
@pytest.mark.parametrize("speed_mps", [4.0, 12.0])
def test_a_car_that_waits_for_the_junction_to_clear_has_no_tail_on_a_line_whose_light_may_turn(
    line_m: float, speed_mps: float
) -> None:
    waits = VehicleState(7, "car", 104.0, 0.0, 0.0, 0.0, 4.6, 1.85, "b")
    green = Signal("s", "green", ("a",), ((line_m, -2.0), (line_m, 2.0)))
    state, tick = BicycleState(Pose(20.0, 0.0, 0.0), speed_mps), 0
    driver = TownDriver(ROAD, LINCOLN_MKZ, DT, lambda: seen(state, tick, green, waits))
    for tick in range(500):  # noqa: B007 - what is seen reads it
        command = driver.command(driver.settle(Setpoints(speed_mps)))
        state = advanced(state, command.acceleration_mps2, command.steering_rad, DT, LINCOLN_MKZ)
    assert state.speed_mps < 0.1 and state.middle(LINCOLN_MKZ).x_m > 60.0
    # By the rules of the leaderboard a light that turns red now is run where the line lies in this part of the car.
    middle, half = state.middle(LINCOLN_MKZ).x_m, LINCOLN_MKZ.length_m / 2.0
    assert not middle - half - 1.0 < line_m < middle - 0.8 * half
