# pyright: reportMissingImports=false, reportUnknownMemberType=false
"""Our planners behind `egodriver.EgodriverService`, the contract by which AlpaSim, and CARLA through
`autoware_carla_scenario`, ask a policy over gRPC for the next seconds of the ego's way.

    start_session                       a rollout begins
    egomotion, route, pictures          what is known of it
    drive(now)     ─▶ plan_once         words, situation, pictures ─▶ P, checked     once, and again for waypoints
                   ─▶ run_episode       P driven ahead in `worlds/route.py`, behind the safety filter
                   ─▶ trajectory        where the ego should be, every 0.1 s for 5 s

Their simulator waits for each answer, so planning takes none of its time. What moves the car there is its own
controller. Only road users that it tells of are known: CARLA tells them, AlpaSim shows pictures alone, and the safety
filter then holds lane, speed and pedals, and keeps clear of nobody.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from carla_driver_interface.driver import BaseDriver, CameraFrame, DriveContext, DriveResult, SessionState
from carla_driver_interface.geometry import Pose as RigPose
from carla_driver_interface.geometry import Trajectory as RigTrajectory
from carla_driver_interface.protocol import TrafficLightState

from chauffeur.concept import (
    CameraImage,
    ChauffeurError,
    Context,
    Instruction,
    Limits,
    Observation,
    Policy,
    Scenario,
    ScenarioError,
    SystemMessage,
    Trajectory,
    VehicleState,
)
from chauffeur.describe import describe_with_traffic
from chauffeur.driving import event_loop
from chauffeur.driving.episode import run_episode
from chauffeur.driving.fallback import keep_lane_and_gap
from chauffeur.driving.loop import steps_at
from chauffeur.driving.planning import PLAN_WITHIN_S, Planned, PlanSteps, no_pictures, plan_once
from chauffeur.driving.session import Forgetful, check_drive
from chauffeur.executors import Executor, executor_for
from chauffeur.executors.base import HeldSetpoints
from chauffeur.foreign.waypoints import FUTURE, STEP_S
from chauffeur.geometry import Polyline, Pose
from chauffeur.planners.base import Planner, looks
from chauffeur.planners.prompts import build_system_message
from chauffeur.planners.prompts.waypoints import HISTORY, command_of, motion_words
from chauffeur.programs.catalogue import vocabulary_of
from chauffeur.safety.shield import shield_for
from chauffeur.worlds.route import CAR, DT_S, LANE, RouteWorld

if TYPE_CHECKING:
    from carla_driver_interface.protocol import CarlaActorState, CarlaRendererData

_log = logging.getLogger(__name__)

WISH: Final = "Follow the road at the speed limit."
HORIZON_S: Final = 5.0
"""Length of an answer: AlpaSim's own drivers answer with 4 to 6.4 s."""
AGAIN_S: Final = 1.0
"""Waypoints that end while the car moves are asked for again after so long, and so is a planner that had no plan. Every
other policy stands."""
_BEHIND_M: Final = 20.0
"""The lane reaches so far behind the first waypoint of the route, which lies at the car or ahead of it."""
_MOST_TICKS: Final = 50
"""Control periods that a policy is asked for after a pause of the other simulator; the rest are left out."""
_STOPPING: Final = (TrafficLightState.TRAFFIC_LIGHT_STATE_RED, TrafficLightState.TRAFFIC_LIGHT_STATE_YELLOW)
_STOP_LINE_M: Final = 0.5
"""Length of the obstacle that stands for a light."""
_STANDS_MPS: Final = 0.3
_LEAST_MPS: Final = 5.0
"""A car that stands looks so far ahead for its next turn as one this fast."""
_MOST_WAYPOINTS: Final = 1_500
_MOST_AGENTS: Final = 400
_KINDS: Final[Mapping[str, str]] = {"walker": "pedestrian"}
"""Kinds of road user by how CARLA's names of blueprints begin; every other is a vehicle."""


@dataclass(slots=True)
class _Rollout:
    """A session: what is driven in it, and since when.

    Attributes:
        planned: Newest plan with its verdicts; None before the first.
        origin: The ego when it was made.
        at_us: When one was last asked for, in the other simulator's time; None before that.
        world: What the policy is bound to: set to each instant, never stepped.
        executor: Of a program, which states set-points period by period; None for what is started anew each time.
        ticked_us: Up to when it has been asked.
        held: Its newest set-points.
    """

    world: RouteWorld = field(default_factory=RouteWorld)
    planned: Planned | None = None
    origin: VehicleState | None = None
    at_us: int | None = None
    executor: Executor | None = None
    ticked_us: int = 0
    held: HeldSetpoints | None = None

    def close(self) -> None:
        """Give back the program's sandbox."""
        if self.executor is not None:
            self.executor.close()
        self.executor = self.held = None


@dataclass(slots=True)
class _Held:
    """Set-points that stand while the way ahead is foreseen."""

    kept: HeldSetpoints

    def tick(self) -> HeldSetpoints:
        return self.kept


class EgoDriver(BaseDriver):
    """A planner and a wish as a driving policy of the egodriver contract; serve it with `run_server` of the library."""

    def __init__(
        self, planner: Planner, wish: str = WISH, *, limit_mps: float = 13.9, limits: Limits | None = None
    ) -> None:
        """Args: who plans; the passenger's words; speed limit where none is told, m/s; limits of the person."""
        self.name = f"chauffeur-{planner.id}"
        self._planner, self._wish, self._limit_mps = planner, Instruction(wish), limit_mps
        self._limits = Limits() if limits is None else limits
        self._rollouts: dict[str, _Rollout] = {}

    def on_session_start(self, session: SessionState) -> None:
        self._rollouts[session.uuid] = _Rollout()

    def on_session_close(self, session: SessionState) -> None:
        if (rollout := self._rollouts.pop(session.uuid, None)) is not None:
            rollout.close()

    def drive(self, ctx: DriveContext) -> DriveResult:
        """The way ahead for 5 s; none, which holds the car, where pose or route are not known or make no sense.

        A wish that is declined, and a planner that fails, leave the car to keep its lane and speed.
        """
        scenario = situation_of(ctx, self._limit_mps)
        if scenario is None:
            return DriveResult(RigTrajectory.empty())
        rollout = self._rollouts[ctx.session.uuid]
        try:
            now = rollout.world.reset(scenario)
        except ScenarioError as error:  # a number that is none, a route without length
            _log.warning("%s: %s", self.name, error)
            return DriveResult(RigTrajectory.empty())
        scalars = {"speed_mps": now.ego.speed_mps}
        if self._is_due(rollout, ctx.time_now_us):
            scalars["planning_s"] = self._plan(rollout, now, ctx)
        poses = self._ahead(rollout, scenario, now, ctx.time_now_us)
        return DriveResult(_in_rig(poses, ctx.time_now_us), debug_scalars=scalars)

    def _is_due(self, rollout: _Rollout, now_us: int) -> bool:
        if rollout.at_us is not None and now_us - rollout.at_us < round(AGAIN_S * 1e6):
            return False
        policy = None if rollout.planned is None else rollout.planned.plan.policy
        return rollout.planned is None or (isinstance(policy, Trajectory) and _goes_on(policy))

    def _plan(self, rollout: _Rollout, now: Observation, ctx: DriveContext) -> float:
        """Ask for a plan; how long it took, s. Without one the plan before it stays."""
        rollout.at_us = ctx.time_now_us
        try:
            planned = event_loop.run(plan_once(self._wish, self._steps(now, motion_of(ctx, now), _pictures(ctx))))
        except ChauffeurError as error:
            _log.warning("%s: no plan: %s", self.name, error)
            return 0.0
        if planned.refusal:
            _log.warning("%s: not driven: %s", self.name, planned.refusal)
        rollout.close()
        rollout.planned, rollout.origin, rollout.ticked_us = planned, now.ego, ctx.time_now_us
        return planned.plan.latency_s

    def _steps(self, now: Observation, motion: str, images: tuple[CameraImage, ...]) -> PlanSteps:
        def describe(observation: Observation) -> Context:
            context = describe_with_traffic(observation)
            return replace(context, text=f"{context.text}\n{motion}")

        def system(limits: Limits) -> SystemMessage:
            return build_system_message("few-shot", limits=limits, vocabulary=vocabulary_of(now.kind))

        steps = steps_at(
            now,
            self._planner,
            Forgetful(),
            self._limits,
            describe=describe,
            system=system,
            check=check_drive,
            see=(lambda _: images) if looks(self._planner) else no_pictures,
        )
        return replace(steps, within_s=PLAN_WITHIN_S)

    def _ahead(self, rollout: _Rollout, scenario: Scenario, now: Observation, now_us: int) -> list[Pose]:
        """Where the rear axle will be, every 0.1 s from now on, in the frame that it has now."""
        ahead = RouteWorld()
        ahead.reset(scenario)
        policy = self._driven(rollout, ahead, now, now_us)
        try:
            episode = run_episode(
                ahead, policy, None, max_s=HORIZON_S, shield=shield_for(ahead, self._limits), limits=self._limits
            )
        finally:
            if isinstance(policy, Executor):
                policy.close()
        egos = [frame.observation.ego for frame in episode.frames[1:]] + [episode.final.ego]
        here = _rear(now.ego)
        poses = [_seen(here, _rear(ego)) for ego in egos]
        return poses + [poses[-1]] * (round(HORIZON_S / DT_S) - len(poses))  # it stands where the foreseen drive ended

    def _driven(self, rollout: _Rollout, ahead: RouteWorld, now: Observation, now_us: int) -> Executor | _Held | None:
        """What drives ahead; None for the world's own driver, which keeps lane and speed."""
        planned = rollout.planned
        if planned is None or planned.refusal or planned.plan.policy is None:
            return None
        policy = planned.plan.policy
        try:
            if policy.kind != "program":
                executor = executor_for(policy, ahead)
                executor.start(policy, ahead.observe(), self._limits, rollout.origin)
                return executor
            self._tick(rollout, now, policy, now_us)
        except ScenarioError as error:
            _log.warning("%s: cannot be driven here: %s", self.name, error)
            return None
        return None if rollout.held is None else _Held(rollout.held)

    def _tick(self, rollout: _Rollout, now: Observation, policy: Policy, now_us: int) -> None:
        """Ask the program for the control periods that have passed. One that fails keeps lane and gap from then on."""
        if rollout.executor is None:
            rollout.executor = executor_for(policy, rollout.world)
            rollout.executor.start(policy, now, self._limits)
            periods = 1
        else:
            periods = round((now_us - rollout.ticked_us) * 1e-6 / DT_S)
        if rollout.held is not None and rollout.held.error is not None:
            return
        for _ in range(min(periods, _MOST_TICKS)):
            tick = rollout.executor.tick()
            rollout.held = HeldSetpoints(tick.setpoints, error=tick.error)
            if tick.error is not None:
                _log.warning("%s: the program failed: %s", self.name, tick.error)
                kept = keep_lane_and_gap(tick.setpoints, now.ego.speed_mps, now.ego.lane)
                rollout.held = HeldSetpoints(kept, error=tick.error)
                break
        if periods:
            rollout.ticked_us = now_us


def situation_of(ctx: DriveContext, limit_mps: float) -> Scenario | None:
    """What a session knows of the road now, as a scenario of `RouteWorld`, in the session's local frame.

    Args:
        ctx: The question.
        limit_mps: Speed limit where none is told.

    Returns:
        None before a pose and two waypoints are known.
    """
    session = ctx.session
    with session.lock:
        pose = session.ego_trajectory.interpolate(ctx.time_now_us) or session.latest_pose()
        at_route = session.ego_trajectory.interpolate(session.route_timestamp_us) or pose
        waypoints = session.route_waypoints_in_rig
        state, speed = session.latest_dynamic_state(), session.speed_mps()
    if pose is None or at_route is None or len(waypoints) < 2:
        return None
    route = [(float(x), float(y)) for x, y, _ in at_route.transform_points(waypoints)[:_MOST_WAYPOINTS]]
    data = ctx.renderer_data
    told = 0.0 if data is None else float(data.speed_limit_mps)
    config: dict[str, Any] = {
        "route": [_before(route), *route],
        "x_m": float(pose.position[0]),
        "y_m": float(pose.position[1]),
        "heading_rad": pose.yaw,
        "speed_mps": speed,
        "acceleration_mps2": 0.0 if state is None else float(state.linear_acceleration.x),
        "limit_mps": told if told > 0.0 else limit_mps,
        "agents": [] if data is None else _agents(data, pose, route),
        "tick": max(0, round(ctx.time_now_us * 1e-6 / DT_S)),
    }
    return Scenario(session.scene_id or session.uuid, "route", config, session.seed)


def motion_of(ctx: DriveContext, now: Observation) -> str:
    """Own motion over 2 s and where the route turns, in words for C; before the rollout the car drove straight on."""
    session, here = ctx.session, ctx.session.latest_pose()
    history = np.zeros((HISTORY + 1, 3))
    for i in range(HISTORY):
        back_s = (HISTORY - i) * STEP_S
        then_us = ctx.time_now_us - round(back_s * 1e6)
        with session.lock:
            known = session.ego_trajectory.timestamps_us
            pose = session.ego_trajectory.interpolate(then_us) if known and known[0] <= then_us else None
        if pose is None or here is None:
            history[i] = -back_s * now.ego.speed_mps, 0.0, 0.0
            continue
        seen = here.inverse() @ pose
        history[i] = seen.position[0], seen.position[1], seen.yaw
    return motion_words(history, _command(now))


def _command(now: Observation) -> str:
    """What nuScenes' users take for the navigation's command: which side the route lies on after three seconds."""
    centre = now.road[LANE].centre
    ahead = centre.nearest(now.ego.x_m, now.ego.y_m) + max(now.ego.speed_mps, _LEAST_MPS) * STEP_S * FUTURE
    there = centre.at(min(ahead, centre.length_m))
    aside = Pose(now.ego.x_m, now.ego.y_m, now.ego.heading_rad).sees(there.x_m, there.y_m)[1]
    return command_of(aside)


def _before(route: list[tuple[float, float]]) -> tuple[float, float]:
    """A place straight behind the first waypoint: the route begins at the car, whose lane does not."""
    (x, y), further = route[0], next((one for one in route[1:] if math.dist(one, route[0]) > 0.1), None)
    if further is None:
        return x, y
    away = math.dist(route[0], further)
    return x - (further[0] - x) / away * _BEHIND_M, y - (further[1] - y) / away * _BEHIND_M


def _agents(data: CarlaRendererData, pose: RigPose, route: list[tuple[float, float]]) -> list[dict[str, Any]]:
    """Road users that the simulator tells of; a light that is red or yellow stands as an obstacle at its stop line."""
    found = [_agent(one) for one in list(data.actors)[:_MOST_AGENTS]]
    distance = float(data.ego_traffic_light_distance_m)
    if data.ego_traffic_light in _STOPPING and distance >= 0.0:
        line = Polyline.of([_before(route), *route])
        here = line.nearest(float(pose.position[0]), float(pose.position[1]))
        at = line.at(min(line.length_m, here + distance))
        bar = {"kind": "static", "length_m": _STOP_LINE_M, "width_m": 2.0}
        found.append({**bar, "x_m": at.x_m, "y_m": at.y_m, "heading_rad": at.heading_rad})
    return found


def _agent(actor: CarlaActorState) -> dict[str, Any]:
    place = RigPose.from_proto(actor.pose_local_to_aabb)
    moved = actor.dynamic_state.linear_velocity
    kind = next((ours for theirs, ours in _KINDS.items() if actor.type_id.startswith(theirs)), "car")
    return {
        "kind": kind,
        "x_m": float(place.position[0]),
        "y_m": float(place.position[1]),
        "heading_rad": place.yaw,
        "speed_mps": math.hypot(moved.x, moved.y),
        "length_m": min(50.0, max(0.3, float(actor.aabb.size_x))),
        "width_m": min(10.0, max(0.3, float(actor.aabb.size_y))),
    }


def _goes_on(policy: Trajectory) -> bool:
    """True if the car still moves at the end of a trajectory, which is then a part of the way and no whole drive."""
    before, last = ((0.0, 0.0), *policy.waypoints_m)[-2:]
    return math.dist(before, last) / policy.period_s > _STANDS_MPS


def _pictures(ctx: DriveContext) -> tuple[CameraImage, ...]:
    """The newest picture of the camera that looks ahead: the one named so, else the first that has one."""
    names = sorted(ctx.session.cameras, key=lambda name: "front" not in name)
    for name in names:
        frame = ctx.session.latest_frame(name)
        if isinstance(frame, CameraFrame):
            return (CameraImage("front", frame.frame_end_us * 1e-6, frame.image_bytes),)
    return ()


def _rear(ego: VehicleState) -> Pose:
    return Pose(ego.x_m, ego.y_m, ego.heading_rad).ahead(-CAR.rear_to_middle_m)


def _seen(here: Pose, there: Pose) -> Pose:
    return Pose(*here.sees(there.x_m, there.y_m), there.heading_rad - here.heading_rad)


def _in_rig(poses: list[Pose], now_us: int) -> RigTrajectory:
    """Poses of the rear axle, 0.1 s apart, the first at 0.1 s from now, in the rig frame of now."""
    found, step_us = RigTrajectory.empty(), round(DT_S * 1e6)
    for i, pose in enumerate(poses, 1):
        found.append(now_us + i * step_us, RigPose.from_xyz_yaw(pose.x_m, pose.y_m, 0.0, pose.heading_rad))
    return found
