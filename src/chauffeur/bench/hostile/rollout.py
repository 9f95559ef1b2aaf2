"""Work of a worker process: check a plan, drive it, and write down what the driver was really given."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

from pydantic import TypeAdapter

from chauffeur.bench.lampilot.rehearse import unhurried_sandbox
from chauffeur.concept import (
    STOP_ZONE_M,
    ChauffeurError,
    Frame,
    LaneId,
    Limits,
    Observation,
    Plan,
    Program,
    Scenario,
    stops_at_sign,
)
from chauffeur.driving.episode import Episode, drive_policy, make_world
from chauffeur.driving.planning import checked

ROLLOUT_VERSION: Final = "hostile-rollout-v2"
"""Changes whenever the same plan could drive, or be described, differently."""

MAX_S: Final = 40.0
"""Simulated time of a drive: long enough to overtake, to pull over and to cross a junction."""

_ROLLING_MPS: Final = 1.0

plan_adapter: TypeAdapter[Plan] = TypeAdapter(Plan)


@dataclass(frozen=True, slots=True)
class DriveJob:
    """A plan to check and drive.

    Attributes:
        key: Content hash of the job.
        scenario: Where.
        plan: JSON form of the plan.
        limits: Bounds for the checks, and for the shield.
        shield: Whether the run-time shield has the last word on every command.
    """

    key: str
    scenario: Scenario
    plan: dict[str, Any]
    limits: Limits
    shield: bool

    @property
    def near(self) -> str:
        return self.scenario.id

    def run(self) -> dict[str, Any]:
        return roll_out(self)

    def spoiled(self, detail: str) -> dict[str, Any]:
        row = {"key": self.key, "scene": self.scenario.id, "rollout": ROLLOUT_VERSION, "infra_failed": True}
        return row | {"refused_by": "", "detail": detail, "drive": None}


def roll_out(job: DriveJob) -> dict[str, Any]:
    """Check and drive one job; a row keyed by `key`. Never raises for the plan's or the scene's faults."""
    row: dict[str, Any] = {"key": job.key, "scene": job.scenario.id, "rollout": ROLLOUT_VERSION, "infra_failed": False}
    world = make_world(job.scenario)
    try:
        observation = world.reset(job.scenario)
        found = checked(plan_adapter.validate_python(job.plan), observation, job.limits)
        plan = found.plan
        if found.refusal:
            by = "planner" if plan.refusal else next(one.check for one in found.verdicts if not one.passed)
            return row | {"refused_by": by, "detail": found.refusal, "drive": None}
        assert plan.policy is not None
        sandbox = unhurried_sandbox() if isinstance(plan.policy, Program) else None
        episode = drive_policy(world, plan.policy, None, MAX_S, job.limits, shielded=job.shield, sandbox=sandbox)
    except ChauffeurError as error:
        return job.spoiled(str(error))
    return row | {
        "refused_by": "",
        "detail": episode.causes.detail,
        "drive": asdict(describe_drive(episode, job.limits)),
    }


@dataclass(frozen=True, slots=True)
class HostileDrive:
    """Outcome of a drive, in numbers that later rulers can be laid on.

    Attributes:
        outcome: As in `Episode`.
        program: State of the program at the end.
        seconds: Simulated time driven.
        interventions: Control periods in which the shield changed the command.
        bounded: Set-points that were brought within the limits before the driver was given them, one a control period.
        over_limit_mps: Most by which a target speed that the driver was given exceeded what the limits allow; 0 for
            none.
        below_zero_mps: Most by which one was negative.
        short_headway_s: Most by which a headway that the driver was given fell short of the smallest allowed.
        too_fast_mps: Most by which the car itself was faster than the limits allow.
        ran_sign: Whether the car passed a stop sign without having stopped at it.
        shoulder_s: Time spent rolling on an emergency lane.
        start_speed_mps, end_speed_mps, least_speed_mps, top_speed_mps: Of the car.
        first_target_mps, last_target_mps, least_target_mps, top_target_mps: Target speeds given.
        least_headway_s, most_headway_s: Headways given.
        start_headway_s: Headway before the program said anything.
        turn: Route wished.
        lane_moves: Target lanes given, one after the other, as steps to the right of the lane at the start.
        on_shoulder: Whether the car ended on an emergency lane.
        passed_lead: Whether the car that was ahead at first was behind at some time.
        said: Texts for the passenger.
    """

    outcome: str
    program: str
    seconds: float
    interventions: int
    bounded: int
    over_limit_mps: float
    below_zero_mps: float
    short_headway_s: float
    too_fast_mps: float
    ran_sign: bool
    shoulder_s: float
    start_speed_mps: float
    end_speed_mps: float
    least_speed_mps: float
    top_speed_mps: float
    first_target_mps: float
    last_target_mps: float
    least_target_mps: float
    top_target_mps: float
    start_headway_s: float
    least_headway_s: float
    most_headway_s: float
    turn: str
    lane_moves: tuple[int, ...]
    on_shoulder: bool
    passed_lead: bool
    said: tuple[str, ...]


def describe_drive(episode: Episode, limits: Limits) -> HostileDrive:
    """A drive in numbers. Periods in which the fallback holds the wheel count for the car, not for the settings."""
    frames = episode.frames
    given = [frame for frame in frames if frame.program != "failed"] or list(frames)
    targets = [_speed(frame) for frame in given]
    headways = [frame.setpoints.time_headway_s for frame in given]
    speeds = [frame.observation.ego.speed_mps for frame in frames] + [episode.final.ego.speed_mps]
    return HostileDrive(
        outcome=episode.outcome,
        program=frames[-1].program if frames else "none",
        seconds=episode.duration_s,
        interventions=episode.interventions,
        bounded=sum(count for _, count in episode.bounded),
        over_limit_mps=_most(target - _allowed(frame, limits) for frame, target in zip(given, targets, strict=True)),
        below_zero_mps=_most(-target for target in targets),
        short_headway_s=_most(limits.min_time_headway_s - headway for headway in headways),
        too_fast_mps=_most(frame.observation.ego.speed_mps - _allowed(frame, limits) for frame in frames),
        ran_sign=ran_sign([*(frame.observation for frame in frames), episode.final]),
        shoulder_s=round(_on_shoulder_s(frames), 1),
        start_speed_mps=speeds[0],
        end_speed_mps=speeds[-1],
        least_speed_mps=min(speeds),
        top_speed_mps=max(speeds),
        first_target_mps=targets[0],
        last_target_mps=targets[-1],
        least_target_mps=min(targets),
        top_target_mps=max(targets),
        start_headway_s=1.5,
        least_headway_s=min(headways),
        most_headway_s=max(headways),
        turn=next((frame.setpoints.turn for frame in reversed(given) if frame.setpoints.turn), ""),
        lane_moves=_lane_moves(given),
        on_shoulder=_emergency(episode.final, episode.final.ego.lane),
        passed_lead=_passed_lead([*(frame.observation for frame in frames), episode.final]),
        said=tuple(text for _, text in episode.said)[:5],
    )


def _speed(frame: Frame) -> float:
    target = frame.setpoints.target_speed_mps
    return frame.observation.ego.speed_mps if target is None else target


def _allowed(frame: Frame, limits: Limits) -> float:
    lane = frame.observation.road.get(frame.observation.ego.lane)
    sign = frame.observation.road.least_limit_mps if lane is None else lane.speed_limit_mps
    return limits.most_mps(sign)


def _most(excesses: Iterable[float]) -> float:
    return round(max(0.0, max(excesses, default=0.0)), 6)


def ran_sign(observations: Iterable[Observation]) -> bool:
    """True if a sign was reached and left behind although the car did not stop at it: a stop far before it is none."""
    reached = stood = False
    for observation in observations:
        ahead = observation.stop_sign_m
        if ahead is not None and ahead <= STOP_ZONE_M:
            reached = True
            stood = stood or stops_at_sign(observation.ego.speed_mps, ahead)
        elif reached and not stood:
            return True
        else:
            reached = stood = False
    return False


def _emergency(observation: Observation, lane: LaneId | None) -> bool:
    there = observation.road.get(lane)
    return there is not None and there.emergency


def _on_shoulder_s(frames: Sequence[Frame]) -> float:
    period_s = frames[1].observation.time_s - frames[0].observation.time_s if len(frames) > 1 else 0.0
    return period_s * sum(
        _emergency(frame.observation, frame.observation.ego.lane) and frame.observation.ego.speed_mps > _ROLLING_MPS
        for frame in frames
    )


def _lane_moves(frames: Sequence[Frame]) -> tuple[int, ...]:
    """Steps to the right of the first lane, on the road's first segment and on those that go on from it."""
    moves: list[int] = []
    start = frames[0].observation.ego.lane
    for frame in frames:
        lane = frame.setpoints.target_lane
        if lane is None or start is None:
            continue
        step = frame.observation.road[lane].index - frame.observation.road[start].index
        if step != (moves[-1] if moves else 0):
            moves.append(step)
    return tuple(moves[:20])


def _passed_lead(observations: Sequence[Observation]) -> bool:
    """Along the first heading of the car, which on these roads is the road's."""
    first = observations[0]
    if first.front is None:
        return False
    ahead = math.cos(first.ego.heading_rad), math.sin(first.ego.heading_rad)
    for observation in observations:
        lead = next((other for other in observation.others if other.id == first.front.vehicle), None)
        if lead is None:
            return False
        along = (lead.x_m - observation.ego.x_m) * ahead[0] + (lead.y_m - observation.ego.y_m) * ahead[1]
        if along < 0.0:
            return True
    return False
