# pyright: reportMissingImports=false
"""Planners behind AlpaSim's contract, driven over real gRPC by the other end that its library ships."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

pytest.importorskip("carla_driver_interface", reason="needs the extra egodriver")

import grpc
import numpy as np
from carla_driver_interface.driver import DriveContext, SessionState
from carla_driver_interface.geometry import Pose, Trajectory, waypoints_to_proto
from carla_driver_interface.protocol import (
    AABB,
    CarlaActorState,
    CarlaRendererData,
    DriveRequest,
    DriveSessionCloseRequest,
    DriveSessionRequest,
    DynamicState,
    EgodriverServiceStub,
    RolloutEgoTrajectory,
    Route,
    RouteRequest,
    TrafficLightState,
    Vec3,
    channel_options,
    pack_renderer_data,
)
from carla_driver_interface.server import serving
from carla_driver_interface.testing import FakeCamera, FakeLoop, LoopResult

from chauffeur.concept import Plan, PlannerError, PlanRequest, Program, Thoughts
from chauffeur.concept import Trajectory as Waypoints
from chauffeur.driving.egodriver import EgoDriver, motion_of, situation_of
from chauffeur.planners.base import Planner
from chauffeur.planners.prompts.waypoints import read_motion
from chauffeur.planners.registry import make_planner
from chauffeur.worlds.route import CAR, RouteWorld


class Writes:
    """A planner that writes what it is made with, and counts."""

    id, model = "writes", "writes-v1"
    sees = True

    def __init__(self, policy: Any = None, refusal: str = "") -> None:
        self.policy, self.refusal, self.asked = policy, refusal, list[PlanRequest]()

    async def plan(self, request: PlanRequest) -> Plan:
        self.asked.append(request)
        if self.policy is None and not self.refusal:
            raise PlannerError("The endpoint is down.")
        return Plan(Thoughts("As it is."), self.policy, self.refusal, planner=self.id, model=self.model)


def driven(planner: Planner, wish: str, steps: int, speed_mps: float = 8.0) -> LoopResult:
    with (
        serving(EgoDriver(planner, wish), port=0, host="127.0.0.1") as port,
        FakeLoop(f"127.0.0.1:{port}", [FakeCamera()], initial_speed_mps=speed_mps) as loop,
    ):
        return loop.run(steps)


def test_a_wish_is_driven_over_the_wire() -> None:
    faster = driven(make_planner("onboard"), "Drive at 40 km/h.", 30)
    assert faster.speeds_mps[-1] > 9.0
    assert np.abs(faster.lateral_offsets_m).max() < 0.2
    stopped = driven(make_planner("onboard"), "Stop!", 30)
    assert stopped.speeds_mps[-1] < 2.5  # this loop takes a step's mean speed for that at its end: half the braking


@pytest.mark.parametrize("policy", [None, "declined"])
def test_without_a_plan_the_car_keeps_lane_and_speed(policy: str | None) -> None:
    kept = driven(Writes(refusal="No." if policy else ""), "Fly.", 10)
    assert kept.steps == 10
    assert kept.speeds_mps == pytest.approx([8.0] * 10, abs=0.1)


def test_waypoints_that_leave_the_road_are_not_driven() -> None:
    off = Waypoints(tuple((4.0 * i, 2.0 * i) for i in range(1, 7)), 0.5)
    assert np.abs(driven(Writes(off), "Go.", 15).lateral_offsets_m).max() < 0.2


def test_waypoints_that_go_on_are_asked_for_again_and_a_whole_drive_is_not() -> None:
    on, whole = (
        Writes(Waypoints(tuple((4.0 * i, 0.0) for i in range(1, 7)), 0.5)),
        Writes(Waypoints(tuple((4.0 * i - 0.3 * i * i, 0.0) for i in (1, 2, 3, 4, 5, 6, 6)), 0.5)),
    )
    driven(on, "Go.", 25)
    driven(whole, "Stop in 20 metres.", 25)
    assert (len(on.asked), len(whole.asked)) == (3, 1)
    assert on.asked[0].images[0].pixels().shape == (360, 640, 3)


def test_a_program_that_fails_leaves_the_car_in_its_lane() -> None:
    program = Program(
        "def drive():\n    set_target_speed(6)\n    yield autopilot()\n    set_target_speed(1 / 0)\n"
        "    yield autopilot()\n"
    )
    failed = driven(Writes(program), "Go.", 10)
    assert failed.steps == 10
    assert 4.0 < failed.speeds_mps[-1] < 8.5


def test_the_question_has_own_motion_and_the_way_of_the_route() -> None:
    planner = Writes(refusal="No.")
    driven(planner, "Go.", 3)
    history, command = read_motion(planner.asked[0].context.text)
    assert command == "go straight"
    assert history[:, 0] == pytest.approx([-16.0, -12.0, -8.0, -4.0, 0.0], abs=0.1)


@contextmanager
def asked_by_carla(driver: EgoDriver) -> Iterator[EgodriverServiceStub]:
    with (
        serving(driver, port=0, host="127.0.0.1") as port,
        grpc.insecure_channel(f"127.0.0.1:{port}", options=channel_options()) as channel,
    ):
        stub = EgodriverServiceStub(channel)
        stub.start_session(DriveSessionRequest(session_uuid="one"))
        yield stub
        stub.close_session(DriveSessionCloseRequest(session_uuid="one"))


def answer(stub: EgodriverServiceStub, data: CarlaRendererData, now_us: int = 0, speed_mps: float = 8.0) -> Trajectory:
    """The answer at the origin, on a straight route along x, to what CARLA tells."""
    told = RolloutEgoTrajectory(session_uuid="one")
    told.trajectory.CopyFrom(Trajectory([now_us], [Pose.from_xyz_yaw(0.0, 0.0, 0.0, 0.0)]).to_proto())
    told.dynamic_states.append(DynamicState(linear_velocity=Vec3(x=speed_mps)))
    stub.submit_egomotion_observation(told)
    way = np.stack([np.arange(0.0, 100.0, 2.0), np.zeros(50), np.zeros(50)], axis=1)
    stub.submit_route(
        RouteRequest(session_uuid="one", route=Route(timestamp_us=now_us, waypoints=waypoints_to_proto(way)))
    )
    request = DriveRequest(session_uuid="one", time_now_us=now_us, renderer_data=pack_renderer_data(data))
    return Trajectory.from_proto(stub.drive(request).trajectory)


def test_who_carla_tells_of_is_not_run_into_and_a_red_light_is_not_passed() -> None:
    fast = Program("def drive():\n    set_target_speed(13)\n    for _ in range(600):\n        yield autopilot()\n")
    stands = CarlaActorState(
        type_id="vehicle.tesla.model3",
        pose_local_to_aabb=Pose.from_xyz_yaw(30.0, 0.0, 0.8, 0.0).to_proto(),
        aabb=AABB(size_x=4.7, size_y=1.9, size_z=1.5),
    )
    red = TrafficLightState.TRAFFIC_LIGHT_STATE_RED
    for data, most_m in (
        (CarlaRendererData(actors=[stands]), 30.0 - 4.7 / 2.0),
        (CarlaRendererData(ego_traffic_light=red, ego_traffic_light_distance_m=30.0), 30.0),
        (CarlaRendererData(), np.inf),
    ):
        with asked_by_carla(EgoDriver(Writes(fast), "Go.")) as stub:
            reached = answer(stub, data).positions[-1, 0] + CAR.rear_to_middle_m + CAR.length_m / 2.0
        assert reached < most_m
    assert reached > 40.0


def test_a_speed_limit_that_is_told_holds() -> None:
    fast = Program("def drive():\n    set_target_speed(30)\n    for _ in range(600):\n        yield autopilot()\n")
    with asked_by_carla(EgoDriver(Writes(fast), "Go.")) as stub:
        way = answer(stub, CarlaRendererData(speed_limit_mps=8.0)).positions[:, 0]
    assert np.diff(way).max() / 0.1 < 8.0 + 3.0  # what limits of a person allow above a sign


def test_nothing_is_driven_before_pose_and_route_are_known() -> None:
    with asked_by_carla(EgoDriver(Writes(refusal="No."), "Go.")) as stub:
        assert len(Trajectory.from_proto(stub.drive(DriveRequest(session_uuid="one")).trajectory)) == 0


def test_a_planner_without_a_plan_is_not_asked_in_every_period() -> None:
    silent = Writes()
    driven(silent, "Go.", 25)
    assert len(silent.asked) == 3


def test_numbers_that_are_none_hold_the_car() -> None:
    with asked_by_carla(EgoDriver(Writes(refusal="No."), "Go.")) as stub:
        held = answer(stub, CarlaRendererData(), speed_mps=float("nan"))  # the library answers with the present pose
    assert np.allclose(held.positions, 0.0)


def test_a_route_bends_as_it_is_told() -> None:
    session = SessionState("one", 0, "scene", {})
    session.ego_trajectory.append(0, Pose.from_xyz_yaw(100.0, 50.0, 0.0, np.pi / 2.0))
    session.dynamic_states.append(DynamicState(linear_velocity=Vec3(x=5.0)))
    session.route_waypoints_in_rig = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [14.0, 6.0, 0.0]])
    ctx = DriveContext(session, 0, 100_000, None)
    scenario = situation_of(ctx, 13.9)
    assert scenario is not None
    assert np.allclose(scenario.config["route"], [(100.0, 30.0), (100.0, 50.0), (100.0, 60.0), (94.0, 64.0)])
    world = RouteWorld()
    assert motion_of(ctx, world.reset(scenario)).endswith("Navigation: turn left")
