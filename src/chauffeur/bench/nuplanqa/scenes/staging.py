"""Scenes on streets: road users, their motion over the last two seconds, light and weather.

What a question asks about (ego motion, lights, weather, who is ahead, beside and behind, people on the road) is drawn
independently, so that neither the control signals nor one fact gives another away. Road users keep a constant
acceleration along their lane; no two overlap at any instant. These are staged scenes: no simulator has driven them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Literal

from chauffeur.bench.nuplanqa.scenes.scene import (
    LEFT_TAKEN_M,
    SAMPLES,
    SKIES,
    STEP_S,
    Layout,
    Motion,
    QaScene,
    QaUser,
    Sky,
)
from chauffeur.bench.nuplanqa.scenes.streets import WIDTH_M, StreetKind, StreetPlan, road_of
from chauffeur.concept.scene import AgentKind, Observation, Signal, SignalState, VehicleState
from chauffeur.geometry.box import overlap

if TYPE_CHECKING:
    import numpy as np

    from chauffeur.geometry import RoadGraph

WHEELBASE_M: Final = 3.089
"""nuPlan's vehicle (Chrysler Pacifica): the angle of its front wheels is what the questions quote."""

SIZES: Final[dict[AgentKind, tuple[float, float]]] = {
    "car": (4.6, 1.9),
    "truck": (9.0, 2.5),
    "bus": (12.0, 2.55),
    "motorcycle": (2.2, 0.8),
    "bicycle": (1.8, 0.6),
    "pedestrian": (0.5, 0.6),
}
EGO_ID: Final = 0
SHAKE_RAD: Final = math.radians(0.3)
"""By how much the ego's front wheels shake, as a driver's do."""
TOP_MPS: Final = 14.0
"""Everywhere the same: a higher speed on wide roads would tell from the control signals what the pictures show."""
EGO_SIZE: Final = (5.2, 2.0)
Theme = Literal["any", "junction", "walker", "pass", "slow", "dense"]
_THEMES: Final[tuple[Theme, ...]] = ("any", "any", "junction", "junction", "walker", "pass", "slow", "dense")
"""Theme of a scene. Without themes, a walker with nothing else to heed or a lane free to pass in is rare."""
_LEADS: Final = ("none", "none", "near", "near", "closing", "opening", "opening", "far")
_FAR_M: Final = (30.0, 95.0)
"""Distance of a lead vehicle of `far`, m; only the nearer ones are asked about."""


@dataclass(frozen=True, slots=True)
class StagedMover:
    """A road user on its way along the street.

    Attributes:
        id: Its id in the observations.
        kind: What it is.
        station_m, offset_m: Where its middle is now, along the street and to the left of the carriageway's left edge.
        speed_mps: Now, along the street; negative against it.
        acceleration_mps2: Along its own direction.
        across_mps: Speed to the left across the street, of pedestrians.
    """

    id: int
    kind: AgentKind
    station_m: float
    offset_m: float
    speed_mps: float
    acceleration_mps2: float = 0.0
    across_mps: float = 0.0

    def at(self, ago_s: float) -> StagedMover:
        """The same some time ago."""
        sign = -1.0 if self.speed_mps < 0.0 else 1.0
        speed = abs(self.speed_mps)
        before = max(0.0, speed - self.acceleration_mps2 * ago_s)
        way = (speed + before) / 2.0 * ago_s
        return replace(
            self,
            station_m=self.station_m - sign * way,
            speed_mps=sign * before,
            offset_m=self.offset_m - self.across_mps * ago_s,
        )


def stage(token: str, rng: np.random.Generator) -> QaScene:
    """Draw a scene."""
    while True:
        scene = _draw(token, rng)
        if scene is not None:
            return scene


def _draw(token: str, rng: np.random.Generator) -> QaScene | None:
    theme = _THEMES[int(rng.integers(len(_THEMES)))]
    plan = _street(rng, theme)
    motion: Motion = ("still", "steady", "faster", "slower")[int(rng.integers(4))]
    speed = 0.0 if motion == "still" else float(rng.uniform(0.15, 1.0)) * TOP_MPS
    gain = {"still": 0.0, "steady": 0.0, "faster": 1.0, "slower": -1.0}[motion] * float(rng.uniform(0.9, 1.8))
    if gain > 0.0:
        speed = max(speed, 2.0 * gain + 0.5)
    own = int(rng.integers(1 if theme == "pass" else 0, plan.lanes))
    ego = StagedMover(EGO_ID, "car", 0.0, plan.lane_offset(own), speed, gain)
    crowd = _Crowd(plan, rng, [])
    lead = _lead(crowd, own, ego, theme)
    apart = (
        theme == "dense" and rng.random() < 0.7
    )  # with a vehicle half beside the ego, the count of those ahead is unclear
    left = None if apart or theme == "pass" else _beside(crowd, own - 1)
    right = None if apart else _beside(crowd, own + 1)
    behind = None
    if rng.random() < 0.55:
        behind = crowd.add(_vehicle(rng), -float(rng.uniform(11.0, 22.0)), plan.lane_offset(own), speed)
    walker = _walker(crowd, theme)
    light: SignalState | None = None
    if plan.kind == "crossing" and rng.random() < 0.78:
        light = ("red", "yellow", "green")[int(rng.integers(3))]
    near = lead is not None and lead.station_m < _FAR_M[0]
    _fill(crowd, None if near else own, theme)
    road = road_of(plan)
    movers = (ego, *crowd.movers)
    if _overlap(plan, movers):
        return None
    sky: Sky = SKIES[int(rng.integers(len(SKIES)))]
    signals = _signals(plan, light)
    shakes = rng.normal(0.0, SHAKE_RAD, SAMPLES).tolist()
    ahead, astride = _ahead(crowd.movers)
    return QaScene(
        token=token,
        source=f"staged {plan.kind}",
        kind=plan.kind,
        lanes=plan.lanes,
        own=own,
        layout=_layout(plan),
        motion=motion,
        sky=sky,
        light=light,
        light_id="own",
        left_taken=any(
            0.0 < one.station_m < LEFT_TAKEN_M and abs(one.offset_m - plan.lane_offset(own - 1)) < WIDTH_M / 2.0
            for one in crowd.movers
        ),
        lead=_user(lead),
        left=_user(left),
        right=_user(right),
        behind=_user(behind),
        walker=_user(walker),
        walker_from="left" if walker is not None and walker.across_mps < 0.0 else "right",
        ahead=ahead,
        unclear=frozenset({"density"} if astride else ()),
        instants=tuple(_observe(plan, road, movers, signals, place, shake) for place, shake in enumerate(shakes)),
    )


def _user(mover: StagedMover | None) -> QaUser | None:
    return None if mover is None else QaUser(mover.id, mover.kind, mover.station_m)


def _layout(plan: StreetPlan) -> Layout:
    if plan.junction_m is not None:
        return "junction"
    return "straight" if plan.curvature_per_m == 0.0 else "left" if plan.curvature_per_m > 0.0 else "right"


def _ahead(movers: Sequence[StagedMover]) -> tuple[tuple[QaUser, ...], bool]:
    """Vehicles wholly ahead of the ego's front in its direction, and whether one is half beside it."""
    ours = [one for one in movers if one.kind != "pedestrian" and one.offset_m < 0.0]
    front = EGO_SIZE[0] / 2.0
    ahead = [one for one in ours if one.station_m - SIZES[one.kind][0] / 2.0 > front]
    astride = any(one not in ahead and one.station_m + SIZES[one.kind][0] / 2.0 > front + 1.0 for one in ours)
    return tuple(QaUser(one.id, one.kind, one.station_m) for one in ahead), astride


def _street(rng: np.random.Generator, theme: Theme) -> StreetPlan:
    kinds: tuple[StreetKind, ...] = ("highway", "street", "crossing", "crossing")
    kind: StreetKind = kinds[int(rng.integers(4))]
    if theme != "any":
        fixed: dict[str, StreetKind] = {"walker": "street", "junction": "crossing"}
        kind = fixed.get(theme) or kinds[int(rng.integers(2))]
    lanes = int(rng.integers(2, 5)) if kind == "highway" else int(rng.integers(2 if theme == "pass" else 1, 4))
    if kind == "crossing":
        return StreetPlan(kind, lanes, junction_m=float(rng.uniform(16.0, 40.0)), crosswalk_m=None)
    radius = float(rng.uniform(55.0, 95.0)) * (1.0 if kind == "street" else 1.6)
    bend = (0.0, 1.0, -1.0)[int(rng.integers(3))] / radius
    crosswalk = float(rng.uniform(9.0, 20.0)) if theme in ("any", "walker") and kind == "street" else None
    start = 12.0 if crosswalk is None else crosswalk + 5.0
    return StreetPlan(kind, lanes, bend, start, crosswalk_m=crosswalk)


@dataclass(slots=True)
class _Crowd:
    plan: StreetPlan
    rng: np.random.Generator
    movers: list[StagedMover]

    def add(
        self,
        kind: AgentKind,
        station_m: float,
        offset_m: float,
        speed_mps: float,
        gain_mps2: float = 0.0,
        across_mps: float = 0.0,
    ) -> StagedMover:
        mover = StagedMover(len(self.movers) + 1, kind, station_m, offset_m, speed_mps, gain_mps2, across_mps)
        self.movers.append(mover)
        return mover


def _vehicle(rng: np.random.Generator) -> AgentKind:
    kinds: tuple[AgentKind, ...] = ("car", "truck", "bus")
    return kinds[int(rng.integers(3))]


def _lead(crowd: _Crowd, own: int, ego: StagedMover, theme: Theme) -> StagedMover | None:
    plan, rng = crowd.plan, crowd.rng
    how = _LEADS[int(rng.integers(len(_LEADS)))]
    if theme in ("pass", "slow"):
        how = "closing"
    if theme == "walker" or (theme == "junction" and rng.random() < 0.5):
        how = "none"
    if how == "far" and (plan.junction_m is not None or plan.curvature_per_m != 0.0 or plan.crosswalk_m is not None):
        how = "near"
    if how == "none":
        return None
    kinds: tuple[AgentKind, ...] = (
        "car",
        "truck",
        "bus",
        "motorcycle",
        *(() if plan.kind == "highway" else ("bicycle",)),
    )
    kind = kinds[int(rng.integers(len(kinds)))]
    room = plan.junction_m - 2.0 if plan.junction_m is not None else 32.0
    own_speed = ego.speed_mps
    if how == "far":
        its = max(0.0, own_speed + float(rng.uniform(-4.0, 4.0)))
        return crowd.add(kind, float(rng.uniform(*_FAR_M)), plan.lane_offset(own), its, ego.acceleration_mps2)
    change = float(rng.uniform(1.6, 3.0) if how == "opening" else rng.uniform(2.5, 4.0))
    at = 5.5 + SIZES[kind][0] / 2.0 + float(rng.uniform(3.0, 14.0))
    if how == "opening":  # it was nearer before, and must not have overlapped the ego
        at += change * STEP_S * (SAMPLES - 1)
    if at + SIZES[kind][0] / 2.0 > room:
        return None
    if how == "closing":
        its = max(0.0, own_speed - change)
        if own_speed - its < 2.0:
            return None
    elif how == "opening":
        its = own_speed + change
    else:
        its = own_speed
    # With the ego's own acceleration, so that whether the gap closes does not hang on the ego's motion.
    return crowd.add(kind, at, plan.lane_offset(own), its, ego.acceleration_mps2)


def _beside(crowd: _Crowd, lane: int) -> StagedMover | None:
    plan, rng = crowd.plan, crowd.rng
    if not 0 <= lane < plan.lanes or rng.random() < 0.3:
        return None
    kind = _vehicle(rng)
    speed = float(rng.uniform(0.3, 1.0)) * TOP_MPS
    return crowd.add(kind, float(rng.uniform(1.0, 8.0)), plan.lane_offset(lane), speed)


def _walker(crowd: _Crowd, theme: Theme) -> StagedMover | None:
    plan, rng = crowd.plan, crowd.rng
    if plan.crosswalk_m is None or (theme != "walker" and rng.random() < 0.5):
        return None
    side = 1.0 if rng.random() < 0.5 else -1.0
    edge = WIDTH_M * plan.oncoming if side > 0 else -WIDTH_M * plan.lanes
    offset = edge - side * float(rng.uniform(0.6, 2.6))
    return crowd.add("pedestrian", plan.crosswalk_m, offset, 0.0, across_mps=-side * 1.3)


def _fill(crowd: _Crowd, empty: int | None, theme: Theme) -> None:
    """Further traffic: oncoming, farther ahead in other lanes but an `empty` one, people on the pavement."""
    plan, rng = crowd.plan, crowd.rng
    for index in range(plan.oncoming):
        for _ in range(int(rng.integers(0, 3))):
            at, speed = float(rng.uniform(5.0, 70.0)), float(rng.uniform(4.0, 11.0))
            crowd.add(_vehicle(rng), at, plan.oncoming_offset(index), -speed)
    many = int(rng.integers(3, 8)) if theme == "dense" else int(rng.integers(0, 4))
    for _ in range(many):
        lane = int(rng.integers(plan.lanes))
        far = 0.0 if plan.junction_m is None else plan.junction_m + plan.junction_length_m
        at = far + float(rng.uniform(26.0, 60.0))
        if lane != empty:
            speed = float(rng.uniform(0.4, 1.0)) * TOP_MPS
            crowd.add(_vehicle(rng), at, plan.lane_offset(lane), speed)
    if plan.kind != "highway":
        for _ in range(int(rng.integers(0, 4))):
            right = rng.random() < 0.5
            offset = -plan.lanes * WIDTH_M - 1.8 if right else plan.oncoming * WIDTH_M + 1.8
            crowd.add("pedestrian", float(rng.uniform(-20.0, 45.0)), offset, float(rng.choice([-1.3, 1.3])))


def _overlap(plan: StreetPlan, movers: Sequence[StagedMover]) -> bool:
    """True if two road users are closer than half a metre at any instant."""
    for place in range(SAMPLES):
        ago = STEP_S * (SAMPLES - 1 - place)
        boxes = [_state(plan, mover.at(ago)).box for mover in movers]
        for i, one in enumerate(boxes):
            for other in boxes[i + 1 :]:
                reach = (one.length_m + other.length_m) / 2.0 + 2.0
                if math.hypot(one.x_m - other.x_m, one.y_m - other.y_m) < reach and overlap(one.grown(0.5), other):
                    return True
    return False


def _signals(plan: StreetPlan, light: SignalState | None) -> tuple[Signal, ...]:
    if light is None or plan.junction_m is None:
        return ()
    at = plan.junction_m
    lanes = tuple(f"own.{index}" for index in range(plan.lanes))
    line = (plan.place(at, 0.0), plan.place(at, -plan.lanes * WIDTH_M))
    cross: SignalState = "green" if light == "red" else "red"
    far = at + plan.junction_length_m
    others = tuple(f"other.{index}" for index in range(plan.oncoming))
    facing = (plan.place(far, plan.oncoming * WIDTH_M), plan.place(far, 0.0))
    middle, half = at + plan.junction_length_m / 2.0, plan.junction_length_m / 2.0 + 2.0
    from_left = ((middle - WIDTH_M, half), (middle, half))
    from_right = ((middle, -half), (middle + WIDTH_M, -half))
    return (
        Signal("own", light, lanes, line),
        Signal("other", light, others, facing),
        Signal("left", cross, ("left.0",), from_left),
        Signal("right", cross, ("right.0",), from_right),
    )


def _observe(
    plan: StreetPlan,
    road: RoadGraph,
    movers: Sequence[StagedMover],
    signals: tuple[Signal, ...],
    place: int,
    shake_rad: float,
) -> Observation:
    """The instant of a place in the clip; the ego's front wheels are shaken by a small angle, as a driver's are."""
    ago = STEP_S * (SAMPLES - 1 - place)
    ego, *others = (_state(plan, mover.at(ago)) for mover in movers)
    return Observation(
        time_s=place * STEP_S,
        tick=place,
        kind=plan.kind,
        ego=replace(ego, steering_rad=ego.steering_rad + shake_rad),
        others=tuple(others),
        objects=(),
        road=road,
        front=None,
        stop_sign_m=None,
        off_road=False,
        ended=False,
        signals=signals,
    )


def _state(plan: StreetPlan, mover: StagedMover) -> VehicleState:
    x, y = plan.place(mover.station_m, mover.offset_m)
    along = plan.heading(mover.station_m)
    heading = along + (math.pi if mover.speed_mps < 0.0 else 0.0)
    if mover.across_mps:
        heading = along + math.copysign(math.pi / 2.0, mover.across_mps)
    length, width = EGO_SIZE if mover.id == EGO_ID else SIZES[mover.kind]
    curvature = plan.curvature_per_m if mover.station_m > plan.bend_m else 0.0
    # Stations are those of the street's line: on the outside of a bend a metre of it is a longer way.
    speed = abs(mover.speed_mps) * (1.0 - curvature * mover.offset_m) or abs(mover.across_mps)
    return VehicleState(
        id=mover.id,
        kind=mover.kind,
        x_m=x,
        y_m=y,
        heading_rad=heading,
        speed_mps=speed,
        length_m=length,
        width_m=width,
        lane=None,
        acceleration_mps2=mover.acceleration_mps2,
        yaw_rate_radps=speed * curvature,
        steering_rad=math.atan(WHEELBASE_M * curvature),
    )
