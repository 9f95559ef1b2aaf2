"""A test track: one car on a proving ground, a lead vehicle, three manoeuvres, five kinds of weather.

The plant is one of CommonRoad's vehicle models with lagging, noisy actuators; nothing that controls it knows more of it
than its size. Simulated: no tyre was worn.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from chauffeur.concept import Capabilities, Command, Lead, Observation, Scenario, ScenarioError, VehicleState
from chauffeur.control.kinematic_bicycle import KinematicBicycle
from chauffeur.geometry import Box, Pose, overlap
from chauffeur.worlds.base import EGO
from chauffeur.worlds.corridor import Body
from chauffeur.worlds.over_graph import LaneDriver, ObservedPerception
from chauffeur.worlds.path_follower import Chassis
from chauffeur.worlds.skeleton import WorldBase, config_of, finite, set_up
from chauffeur.worlds.track.dynamics import (
    BRAKES_MPS2,
    DRIVE_LAG_S,
    STEP_S,
    Plant,
    advance,
    deliverable,
    initial_state,
)
from chauffeur.worlds.track.manoeuvres import (
    FRICTION,
    LEAD_GAP_M,
    LEAD_MPS,
    LEAD_MPS2,
    Manoeuvre,
    ManoeuvreName,
    Weather,
    manoeuvre,
    proving_ground,
)
from chauffeur.worlds.track.street import StreetConfig, StreetScene, street_scene

DT_S: Final = 0.05
"""Control period of the drive-by-wire: the action matrix is tracked at 20 Hz."""
LENGTH_M: Final = 4.508
WIDTH_M: Final = 1.610
WHEELBASE_M: Final = 2.579
TO_MIDDLE_M: Final = 0.133
"""From the middle of the car forwards to its centre of mass, m."""
STRAY_S: Final = 0.06
"""On a dry road. Of 60 stops from 8.5 m/s with the wheel turned at random, the worst ended 0.5 m beside where a bicycle
put it; of 40 from 5 m/s the worst did by 0.2 m when dry, 0.3 m in rain, and in snow, of which some spun, 9 of 10 by
0.4 m at most."""
GRIP_MPS2: Final = 6.0
"""Lateral acceleration that the model's tyres hold on a dry road beside full braking, with a reserve."""
STEERING_RATE: Final = 0.4
FULL_LOCK_RAD: Final = 0.6
CHASSIS: Final = Chassis(Body(LENGTH_M, WIDTH_M, WHEELBASE_M / 2.0), WHEELBASE_M, FULL_LOCK_RAD, 3.0)
_LEAD: Final = 1
_MOST_MPS2: Final = 3.0
_WANDER_S: Final = 1.0
_WANDER_RAD: Final = 0.0008
_WANDER_MPS2: Final = 0.05
"""Actuators err: by so much in standard deviation, with so long a memory."""


class TrackConfig(BaseModel):
    """A track scenario's configuration: one of the manoeuvres, or a street."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    manoeuvre: ManoeuvreName = "acceleration"
    weather: Weather = "sunny"
    plant: Plant = "std"
    noise: float = Field(default=1.0, ge=0.0, le=10.0)
    street: StreetConfig | None = None


class TrackWorld(WorldBase[ObservedPerception, LaneDriver]):
    """A test track, stepped at 20 Hz."""

    engine = "test track 1 (CommonRoad vehicle models 3.0.2)"
    capabilities = Capabilities(
        roads=("track",),
        policies=("action_matrix", "trajectory", "program"),
        lane_changes=True,
        turns=True,
        horizon_s=45.0,
    )
    dt_s = DT_S
    """Control period, s."""
    chassis = CHASSIS
    """The ego's size and axles."""
    steering_rate = STEERING_RATE
    """Steering rate of the ego, rad/s."""

    def __init__(self) -> None:
        self._config: TrackConfig | None = None
        self._scenario = ""
        self._state = np.zeros(7)
        self._acceleration = 0.0
        self._lost = False
        """True if the model yielded no numbers: a car beyond what it was made for."""
        self._wander = np.zeros(2)
        self._rng = np.random.default_rng(0)
        self._tick = 0
        self._crashed = False

    @property
    def car(self) -> KinematicBicycle | None:
        """The ego, as a filter may count on it in this weather; None on a proving ground, whose manoeuvres may slide.

        Raises:
            ScenarioError: Before the first reset.
        """
        if self._started().street is None:
            return None
        friction = FRICTION[self._started().weather]
        return KinematicBicycle(
            LENGTH_M,
            WIDTH_M,
            WHEELBASE_M,
            WHEELBASE_M / 2.0,
            FULL_LOCK_RAD,
            STEERING_RATE,
            _MOST_MPS2,
            BRAKES_MPS2 * friction,
            GRIP_MPS2 * friction,
            DRIVE_LAG_S,
            STRAY_S / friction,
        )

    @property
    def ground(self) -> Box:
        """The paved area: a proving ground around the lanes. Raises ScenarioError before the first reset."""
        return proving_ground(self._course.road.lanes)

    @property
    def manoeuvre(self) -> Manoeuvre:
        """The manoeuvre set. Raises ScenarioError before the first reset, and on a street, where nothing is set."""
        config = self._started()
        if config.street is not None:
            raise ScenarioError("On an open road no manoeuvre is set.", hint="Drive it with a trajectory or a program.")
        return manoeuvre(config.manoeuvre)

    @property
    def open_road(self) -> bool:
        """True if it is a street, on which no manoeuvre is set."""
        return self._started().street is not None

    @property
    def _course(self) -> Manoeuvre | StreetScene:
        street = self._started().street
        return self.manoeuvre if street is None else street_scene(street)

    @property
    def weather(self) -> Weather:
        """Weather of the scenario."""
        return self._started().weather

    def reset(self, scenario: Scenario, seed: int | None = None) -> Observation:
        """Place the car at the start of its path.

        Raises:
            ScenarioError: The configuration is malformed.
            MissingExtraError: The vehicle models are not installed.
        """
        config = config_of(TrackConfig, scenario, "track")
        self._config, self._scenario = config, scenario.id
        self._rng = np.random.default_rng(np.random.SeedSequence(scenario.seed if seed is None else seed))
        plan = self._course
        start = plan.path.at(0.0) if isinstance(plan, Manoeuvre) else Pose(TO_MIDDLE_M, 0.0, 0.0)
        self._state = initial_state(config.plant, start.x_m, start.y_m, start.heading_rad, plan.start_mps)
        self._acceleration, self._lost = 0.0, False
        self._wander = self._rng.normal(size=2) * (_WANDER_RAD, _WANDER_MPS2) * config.noise
        self._tick, self._crashed, self._shown = 0, False, None
        self._perception = ObservedPerception(self.observe)
        self._driver = LaneDriver(self.observe, self._perception)
        return self.observe()

    def step(self, command: Command) -> Command:
        """Advance 0.05 s under `command`; returns what the actuators were told, and could be."""
        command = finite(command)
        config = self._started()
        friction = FRICTION[config.weather]
        wanted = deliverable(min(_MOST_MPS2, command.acceleration_mps2), friction)
        angle = max(-FULL_LOCK_RAD, min(FULL_LOCK_RAD, command.steering_rad))
        if self._crashed:
            wanted = deliverable(-math.inf, friction)
        kept = math.exp(-DT_S / _WANDER_S)
        spread = math.sqrt(1.0 - kept * kept) * config.noise
        self._wander = kept * self._wander + self._rng.normal(size=2) * (_WANDER_RAD, _WANDER_MPS2) * spread
        off_rad, off_mps2 = self._wander.tolist()
        stands = self._state[3] < 0.05 and wanted <= 0.0
        steps, sound = round(DT_S / STEP_S), self._state.copy()
        self._acceleration = advance(config.plant)(
            self._state,
            self._acceleration,
            friction,
            angle + off_rad,
            0.0 if stands else wanted + off_mps2,
            steps,
        )
        if not np.isfinite(self._state).all():
            self._state, self._acceleration, self._lost = sound, 0.0, True
        self._tick += 1
        self._shown = None
        if self._touching():
            self._crashed, self._shown = True, None
        return Command(wanted, angle)

    def body(self) -> tuple[Pose, float, float]:
        """Centre of mass and heading; speed over ground, m/s; yaw rate, rad/s: the truth of the plant."""
        x, y, _, along, heading, yaw_rate = self._state[:6].tolist()
        return Pose(x, y, heading), math.hypot(along, self._across()), yaw_rate

    def _across(self) -> float:
        """Speed of the centre of mass to the left, m/s."""
        state = self._state
        return float(state[10]) if len(state) > 10 else float(state[3] * math.sin(state[6]))

    def _started(self) -> TrackConfig:
        return set_up(self._config)

    def _lead(self) -> VehicleState | None:
        plan = self._course
        if isinstance(plan, StreetScene) or not plan.lead:
            return None
        rise_s = LEAD_MPS / LEAD_MPS2
        t = self._tick * DT_S
        speed = min(LEAD_MPS2 * t, LEAD_MPS)
        way = 0.5 * LEAD_MPS2 * min(t, rise_s) ** 2 + LEAD_MPS * max(0.0, t - rise_s)
        x = plan.path.at(0.0).x_m - TO_MIDDLE_M + LENGTH_M + LEAD_GAP_M + way
        faster = LEAD_MPS2 if t < rise_s else 0.0
        return VehicleState(_LEAD, "car", x, 0.0, 0.0, speed, LENGTH_M, WIDTH_M, "straight_1", acceleration_mps2=faster)

    def _ego_box(self) -> Box:
        pose = self.body()[0].ahead(-TO_MIDDLE_M)
        return Box(pose.x_m, pose.y_m, pose.heading_rad, LENGTH_M, WIDTH_M)

    def _touching(self) -> bool:
        own = self._ego_box()
        return any(overlap(own, one.box) for one in (*self._others(), *self._objects()))

    def _others(self) -> tuple[VehicleState, ...]:
        plan, lead = self._course, self._lead()
        return plan.parked if isinstance(plan, StreetScene) else () if lead is None else (lead,)

    def _objects(self) -> tuple[VehicleState, ...]:
        plan = self._course
        return plan.cones if isinstance(plan, StreetScene) else ()

    def _look(self) -> Observation:
        plan, box = self._course, self._ego_box()
        place = plan.road.locate(box.x_m, box.y_m, box.heading_rad, kinds=("driving", "emergency"))
        assert place is not None
        lane = plan.road[place.lane]
        ego = VehicleState(
            EGO,
            "car",
            box.x_m,
            box.y_m,
            box.heading_rad,
            float(self._state[3]),
            LENGTH_M,
            WIDTH_M,
            lane.id,
            self._crashed,
            acceleration_mps2=self._acceleration,
            yaw_rate_radps=float(self._state[5]),
            steering_rad=float(self._state[2]),
        )
        lead = self._lead()
        off_road = self._lost or (
            plan.road.ground.off_road(box.x_m, box.y_m)
            if self._started().street is not None
            else all(  # a manoeuvre is judged by its lanes, however wide the ground around them is
                abs(one.centre.offset(box.x_m, box.y_m, place.station_m)) > one.width_m / 2.0
                for one in plan.road.abreast(lane.id)
            )
        )
        late = self._tick * DT_S >= plan.duration_s - 1e-9
        front = None
        if lead is not None and lead.lane == ego.lane and lead.x_m > ego.x_m:
            front = Lead(lead.id, lead.x_m - ego.x_m, lead.speed_mps)
        return Observation(
            time_s=self._tick * DT_S,
            tick=self._tick,
            kind="track",
            ego=ego,
            others=self._others(),
            objects=self._objects(),
            road=plan.road,
            front=front,
            stop_sign_m=None,
            off_road=off_road,
            ended=self._crashed or off_road or late,
        )
