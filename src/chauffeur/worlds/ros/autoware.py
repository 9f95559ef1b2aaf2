"""Messages to Autoware (ROS 2), and why so: message definitions, topics, and every field's value.

Sources: definitions read in `autowarefoundation/autoware_internal_msgs` and `autoware_adapi_msgs`; the rules of
`external_velocity_limit_selector` in Autoware's own documentation of it.

A wished speed is a candidate for the velocity limit, under a sender name of our own. The selector takes the lowest of
all senders, so we can only slow the vehicle below what the others allow; "faster" means lifting our own limit. The
topic `max_velocity_default` is not used: Autoware's own API overwrites it. The mode of operation is read and never
changed from here, and there is no message for the look-ahead: Autoware's controllers choose it themselves.

Cooperation commands are left to a person, too. By the decision table of Autoware's cooperation API, an operator's
ACTIVATE wins over Autoware's own DEACTIVATE: it would start a lane change that Autoware just judged to be unsafe.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

from chauffeur.concept.units import kmh
from chauffeur.worlds.ros.base import Asked, Fields, TopicMessage, VehicleRefusalError
from chauffeur.worlds.ros.limits import CheckedWish, VehicleLimits

CANDIDATE_TOPIC: Final = "/planning/scenario_planning/max_velocity_candidates"
CLEAR_TOPIC: Final = "/planning/scenario_planning/clear_velocity_limit"
CURRENT_TOPIC: Final = "/planning/scenario_planning/current_max_velocity"
MODE_TOPIC: Final = "/api/operation_mode/state"
VELOCITY_TOPIC: Final = "/vehicle/status/velocity_status"

MODE_TYPE: Final = "autoware_adapi_v1_msgs/msg/OperationModeState"
VELOCITY_TYPE: Final = "autoware_vehicle_msgs/msg/VelocityReport"

MODES: Final = {1: "stop", 2: "autonomous", 3: "local", 4: "remote"}

SENDER: Final = "chauffeur"
"""Our name among those who limit the velocity."""

Package = Literal["autoware_internal_planning_msgs", "tier4_planning_msgs"]
"""Packages that define the velocity limit: the former since Autoware 2025, the latter before."""

_CONSTRAINTS: Final[dict[Package, dict[str, float]]] = {
    "autoware_internal_planning_msgs": {
        "max_acceleration": 1.0,
        "min_acceleration": -1.0,
        "max_jerk": 1.0,
        "min_jerk": -1.0,
    },
    "tier4_planning_msgs": {"min_acceleration": -1.0, "max_jerk": 1.0, "min_jerk": -1.0},
}
"""m/s2 and m/s3. Not in force (`use_constraints` is false); gentle values for a reader that does not look."""


def definitions(package: Package) -> dict[str, tuple[tuple[str, str], ...]]:
    """Fields of every type used, by name."""
    return {
        f"{package}/msg/VelocityLimitConstraints": tuple(("float32", name) for name in _CONSTRAINTS[package]),
        f"{package}/msg/VelocityLimit": (
            ("builtin_interfaces/Time", "stamp"),
            ("float32", "max_velocity"),
            ("bool", "use_constraints"),
            (f"{package}/VelocityLimitConstraints", "constraints"),
            ("string", "sender"),
        ),
        f"{package}/msg/VelocityLimitClearCommand": (
            ("builtin_interfaces/Time", "stamp"),
            ("bool", "command"),
            ("string", "sender"),
        ),
        MODE_TYPE: (
            ("builtin_interfaces/Time", "stamp"),
            ("uint16", "mode"),
            ("bool", "is_autoware_control_enabled"),
            ("bool", "is_in_transition"),
            ("bool", "is_stop_mode_available"),
            ("bool", "is_autonomous_mode_available"),
            ("bool", "is_local_mode_available"),
            ("bool", "is_remote_mode_available"),
        ),
        VELOCITY_TYPE: (
            ("std_msgs/Header", "header"),
            ("float32", "longitudinal_velocity"),
            ("float32", "lateral_velocity"),
            ("float32", "heading_rate"),
        ),
    }


@dataclass(frozen=True, slots=True)
class Autoware:
    """Autoware as a `Stack`.

    Attributes:
        limits: What may be published to the vehicle.
        package: Where its velocity limit is defined.
    """

    limits: VehicleLimits
    package: Package = "autoware_internal_planning_msgs"

    def wished(self, wish: CheckedWish) -> Asked:
        """Our velocity limit. Raises VehicleRefusalError for a lane change."""
        if wish.lane != 0:
            raise VehicleRefusalError(
                "Autoware is not asked for lane changes from here: its command for that overrides its own judgement "
                "that one is unsafe. Nothing was published.",
                hint="Its planner chooses lanes along the route; ask for the speed alone.",
            )
        words = f"The vehicle is limited to {kmh(wish.speed_mps):.4g} km/h; the look-ahead is left to Autoware."
        # Both topics are kept for late joiners, in no order: an old `clear` must not meet a selector that starts anew.
        return (self._clear(False), self._limit(wish.speed_mps)), words

    def released(self, last: CheckedWish | None) -> Asked:
        """Our limit is lifted to the highest allowed, then cleared."""
        del last
        words = "The wish is taken back: Autoware alone decides."
        return (self._limit(self.limits.max_speed_mps), self._clear(True)), words

    def closing(self, last: CheckedWish | None) -> Asked:
        """Nothing: a limit stays in force."""
        del last
        return (), ""

    def _limit(self, speed_mps: float) -> TopicMessage:
        constraints: Fields = {**_CONSTRAINTS[self.package]}
        fields: Fields = {
            "max_velocity": speed_mps,  # m/s here
            "use_constraints": False,
            "constraints": constraints,
            "sender": SENDER,
        }
        return TopicMessage(CANDIDATE_TOPIC, f"{self.package}/msg/VelocityLimit", fields, "stamp")

    def _clear(self, clear: bool) -> TopicMessage:
        fields: Fields = {"command": clear, "sender": SENDER}
        return TopicMessage(CLEAR_TOPIC, f"{self.package}/msg/VelocityLimitClearCommand", fields, "stamp")
