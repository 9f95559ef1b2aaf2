"""Messages to Autoware.AI (ROS 1, behind a rosbridge server), and why so: topics, and every field's value.

Sources, read in `autowarefoundation/autoware_ai_planning`: `pure_pursuit/src/pure_pursuit_core.cpp` and
`waypoint_maker/nodes/waypoint_replanner/`; message definitions as generated from `autoware_config_msgs`.

`pure_pursuit` has two sources of speed, chosen by `param_flag` of `ConfigWaypointFollower`:

* 0, waypoints: it drives the speed planned for the next waypoint. The planner has lowered that speed for obstacles,
  stop lines and curves. Speed fields of the message are not used.
* 1, "dialog": it drives the message's constant `velocity` (km/h) whatever the waypoints say. Planned stops, obstacle
  stops among them, no longer reach the vehicle. The Talk2Drive prototype publishes this one.

So a wished speed is not a speed for the follower. It is a cap for the planner: `waypoint_replanner` lowers the speed
of every waypoint to `velocity_max` (km/h), and all that comes after it (obstacle and stop-line stops, `pure_pursuit`)
works as before. A higher wish lifts our own cap; it never lifts a planned speed.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, Literal

from chauffeur.concept.units import MPS_PER_KMH, kmh
from chauffeur.worlds.ros.base import Asked, Fields, TopicMessage, VehicleRefusalError
from chauffeur.worlds.ros.limits import CheckedWish, VehicleLimits

FOLLOWER_TOPIC: Final = "/config/waypoint_follower"
FOLLOWER_TYPE: Final = "autoware_config_msgs/ConfigWaypointFollower"

REPLANNER_TOPIC: Final = "/config/waypoint_replanner"
REPLANNER_TYPE: Final = "autoware_config_msgs/ConfigWaypointReplanner"

VELOCITY_TOPIC: Final = "/current_velocity"
VELOCITY_TYPE: Final = "geometry_msgs/TwistStamped"

WAYPOINT_SOURCE: Final = 0
CONSTANT_SOURCE: Final = 1


@dataclass(frozen=True, slots=True)
class PlannedSpeed:
    """The vehicle drives what its planner planned, under our cap. What is used unless a person decided otherwise."""


@dataclass(frozen=True, slots=True)
class Acknowledgement:
    """A person's word that nothing but the driver's foot will stop the vehicle. Only `settings.py` makes one, from the
    vehicle's configuration file; no parameter, plan or program can hold one.

    Attributes:
        name: Who gave it.
        max_speed_mps: Highest constant speed it covers.
    """

    name: str
    max_speed_mps: float


@dataclass(frozen=True, slots=True)
class ConstantSpeed:
    """The follower drives a constant speed and ignores every planned stop (`param_flag: 1`)."""

    acknowledgement: Acknowledgement


SpeedSource = PlannedSpeed | ConstantSpeed


@dataclass(frozen=True, slots=True)
class Replanner:
    """The vehicle's own settings of `waypoint_replanner`. Our message replaces all of them at once, so they should be
    those of the vehicle's launch file; the defaults can only slow the vehicle.

    Attributes:
        planned_max_mps: Cap when nobody wishes one.
        accel_mps2, decel_mps2: Slopes of the speed profile. Never 0: the replanner would spread the lowest speed over
            the whole lane.
        slow_in_curves: Whether speeds are lowered in curves sharper than `curve_radius_m`, to `curve_speed_mps` at
            `curve_radius_min_m`.
        curve_lead_points: Waypoints before a curve at which slowing begins.
        stop_at_end: Whether the last waypoints are made a stop. It also raises planned speeds below `curve_speed_mps`
            to that speed, so it is off unless the vehicle's launch file has it.
        end_points, braking_points: Waypoints of the stop at the end and of braking before it.
        resample_m: Distance to resample waypoints at; 0 leaves them as they are.
        decision_maker: Whether the vehicle runs the decision maker.
    """

    planned_max_mps: float
    accel_mps2: float = 0.5
    decel_mps2: float = 0.3
    slow_in_curves: bool = True
    curve_radius_m: float = 20.0
    curve_radius_min_m: float = 6.0
    curve_speed_mps: float = 4.0 * MPS_PER_KMH
    curve_lead_points: int = 4
    stop_at_end: bool = False
    end_points: int = 1
    braking_points: int = 5
    resample_m: float = 0.0
    decision_maker: bool = False


def cap_message(cap_mps: float, replanner: Replanner) -> TopicMessage:
    """The speed cap. `velocity_max` and `velocity_min` are km/h in this message (`kmph2mps` in `initParameter`)."""
    slowest_mps = min(replanner.curve_speed_mps, cap_mps)  # above the cap, `velocity_min` would raise speeds past it
    fields: Fields = {
        "multi_lane_csv": "",
        "replanning_mode": True,  # apply `velocity_max` to the waypoints
        "use_decision_maker": replanner.decision_maker,
        "velocity_max": _as_kmh(cap_mps),
        "velocity_min": _as_kmh(slowest_mps),
        "accel_limit": replanner.accel_mps2,
        "decel_limit": replanner.decel_mps2,
        "radius_thresh": replanner.curve_radius_m,
        "radius_min": replanner.curve_radius_min_m,
        "resample_mode": replanner.resample_m > 0.0,
        "resample_interval": replanner.resample_m or 1.0,
        "velocity_offset": replanner.curve_lead_points,
        "end_point_offset": replanner.end_points,
        "braking_distance": replanner.braking_points,
        "replan_curve_mode": replanner.slow_in_curves,
        "replan_endpoint_mode": replanner.stop_at_end,
        "overwrite_vmax_mode": False,  # True would raise every waypoint to `velocity_max`
        "realtime_tuning_mode": True,  # replan now, not at the next route
    }
    return TopicMessage(REPLANNER_TOPIC, REPLANNER_TYPE, fields)


def follower_message(wish: CheckedWish, source: SpeedSource) -> TopicMessage:
    """The look-ahead; with an acknowledgement, also the constant speed.

    Raises:
        VehicleRefusalError: The speed is above what the acknowledgement covers.
    """
    flag: Literal[0, 1] = WAYPOINT_SOURCE
    if isinstance(source, ConstantSpeed):
        flag, most_mps = CONSTANT_SOURCE, source.acknowledgement.max_speed_mps
        if wish.speed_mps > most_mps:
            raise VehicleRefusalError(
                f"A constant speed of {wish.speed_mps:g} m/s is above the {most_mps:g} m/s that "
                f"{source.acknowledgement.name} answers for.",
                hint="Ask for less, or drive by planned speed.",
            )
    fields: Fields = {
        "param_flag": flag,
        "velocity": _as_kmh(wish.speed_mps),
        "lookahead_distance": wish.look_ahead_m,
        "lookahead_ratio": wish.look_ahead_ratio_s,
        # The nearest that waypoint mode looks, and how far from its path's end it stops. With 0 it never stops there.
        "minimum_lookahead_distance": wish.look_ahead_m,
        "displacement_threshold": 0.0,  # not read by `pure_pursuit`; 0 is the runtime manager's own default
        "relative_angle_threshold": 0.0,
    }
    return TopicMessage(FOLLOWER_TOPIC, FOLLOWER_TYPE, fields, "header")


@dataclass(frozen=True, slots=True)
class AutowareAi:
    """Autoware.AI as a `Stack`.

    Attributes:
        limits: What may be published to the vehicle.
        replanner: Its settings of `waypoint_replanner`.
        source: Where the follower's speed comes from.
    """

    limits: VehicleLimits
    replanner: Replanner
    source: SpeedSource = field(default_factory=PlannedSpeed)

    def wished(self, wish: CheckedWish) -> Asked:
        """A cap and a look-ahead. Raises VehicleRefusalError for a lane change, or above an acknowledged speed."""
        if wish.lane != 0:
            raise VehicleRefusalError(
                "Autoware.AI has no message that asks for a lane change; nothing was published.",
                hint="Ask for the speed alone.",
            )
        messages = (cap_message(wish.speed_mps, self.replanner), follower_message(wish, self.source))
        return messages, _words(wish, self.source)

    def released(self, last: CheckedWish | None) -> Asked:
        """The cap goes back to the vehicle's own, and the follower to planned speeds; the look-ahead stays."""
        messages = [cap_message(self.replanner.planned_max_mps, self.replanner)]
        if last is not None:
            messages.append(follower_message(last, PlannedSpeed()))
        return tuple(messages), "The wish is taken back: the vehicle's planner alone decides."

    def closing(self, last: CheckedWish | None) -> Asked:
        """A constant speed ends with us; a cap stays."""
        if last is None or isinstance(self.source, PlannedSpeed):
            return (), ""
        return (follower_message(last, PlannedSpeed()),), "The follower is set back to planned speeds."


def _words(wish: CheckedWish, source: SpeedSource) -> str:
    speed = f"{kmh(wish.speed_mps):.4g} km/h"
    if isinstance(source, ConstantSpeed):
        return (
            f"Constant {speed}, look-ahead {wish.look_ahead_m:g} m; planned stops are IGNORED "
            f"({source.acknowledgement.name} answers for it)."
        )
    ahead = f"look-ahead {wish.look_ahead_ratio_s:g} s, at least {wish.look_ahead_m:g} m"
    return f"Planned speeds are capped at {speed}; {ahead}."


def _as_kmh(speed_mps: float) -> float:
    """km/h as published, to a thousandth: what is printed is then what is sent, to the last digit of a float32."""
    return round(kmh(speed_mps), 3)
