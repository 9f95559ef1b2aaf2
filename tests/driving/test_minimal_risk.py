"""The minimal-risk manoeuvre brakes in every world of ours, whichever law its driver follows."""

import pytest

from chauffeur.concept import Limits, Setpoints
from chauffeur.driving.emergency import planned_for
from chauffeur.driving.episode import drive_policy, make_world
from chauffeur.driving.scenarios import find


@pytest.mark.parametrize(
    ("scenario", "least", "most"),
    [
        ("overtake", 3.5, 5.0),
        ("cruise", 3.5, 5.0),
        ("open-road-straight", 3.0, 5.0),
        ("parking", 2.0, 4.5),
        ("town", 2.0, 3.5),
    ],
)
def test_stop_brakes_evenly_to_a_stand(scenario: str, least: float, most: float) -> None:
    pytest.importorskip({"open-road-straight": "osqp", "town": "libsumo"}.get(scenario, "math"))
    place = find(scenario)
    world = make_world(place)
    world.reset(place)
    for _ in range(round(60.0 / world.dt_s)):
        if world.observe().ego.speed_mps > (2.0 if scenario == "parking" else 7.0):
            break
        world.step(world.driver().command(world.driver().settle(Setpoints(target_speed_mps=12.0))))
    plan = planned_for("Stop!", world.observe())
    assert plan is not None
    assert plan.policy is not None
    frames = drive_policy(world, plan.policy, None, 20.0, Limits()).frames
    speeds = [frame.observation.ego.speed_mps for frame in frames]
    stands = next(i for i, speed in enumerate(speeds) if speed < 0.5)
    braking = (speeds[0] - speeds[stands]) / (stands * world.dt_s)
    assert least < braking < most
