"""The vehicle's configuration file: what a person decided about one vehicle. Models never write it."""

from __future__ import annotations

import datetime
import ipaddress
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from chauffeur.concept import ConfigError
from chauffeur.concept.units import MPS_PER_KMH
from chauffeur.worlds.ros.autoware import Autoware, Package
from chauffeur.worlds.ros.autoware_ai import (
    Acknowledgement,
    AutowareAi,
    ConstantSpeed,
    PlannedSpeed,
    Replanner,
    SpeedSource,
)
from chauffeur.worlds.ros.limits import VehicleLimits
from chauffeur.worlds.ros.ros2 import Ros2Settings
from chauffeur.worlds.ros.rosbridge import RosbridgeSettings

Interface = Literal["ros2", "rosbridge", "dry-run"]
"""Ways to a vehicle."""

SENTENCE: Final = "The follower will ignore planned stops and obstacles; only the driver's foot stops this vehicle."
"""Text that a person has to write, word for word, for a constant speed."""

LONGEST_DAYS: Final = 31
"""Longest validity of an acknowledgement, days; it is then written anew, or not."""

FASTEST_MPS: Final = 60.0
"""Above this a limit is a slip of the pen, or of the unit (216 km/h)."""

Speed = Annotated[float, Field(gt=0.0, le=FASTEST_MPS, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, le=1000.0, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=0, le=1000)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=False)


class _Limits(_Table):
    max_speed_mps: Speed
    look_ahead_m: tuple[Positive, Positive] = (3.0, 30.0)
    look_ahead_ratio_s: tuple[Positive, Positive] = (0.5, 4.0)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        for name in ("look_ahead_m", "look_ahead_ratio_s"):
            low, high = getattr(self, name)
            if low > high:
                raise ValueError(f"{name} goes from {low:g} to {high:g}; the smaller comes first")
        return self


class _Replanner(_Table):
    accel_mps2: Positive = 0.5
    decel_mps2: Positive = 0.3
    slow_in_curves: bool = True
    curve_radius_m: Positive = 20.0
    curve_radius_min_m: Positive = 6.0
    curve_speed_mps: Speed = 4.0 * MPS_PER_KMH
    curve_lead_points: Count = 4
    stop_at_end: bool = False
    end_points: Count = 1
    braking_points: Count = 5
    resample_m: Annotated[float, Field(ge=0.0, le=100.0, allow_inf_nan=False)] = 0.0
    decision_maker: bool = False

    @model_validator(mode="after")
    def _radii(self) -> Self:
        if self.curve_radius_min_m >= self.curve_radius_m:
            raise ValueError("curve_radius_min_m must be smaller than curve_radius_m")
        return self


class _ConstantSpeed(_Table):
    acknowledged_by: Annotated[str, Field(min_length=2, max_length=100)]
    acknowledgement: str
    until: datetime.date
    max_speed_mps: Speed

    @field_validator("acknowledgement")
    @classmethod
    def _word_for_word(cls, said: str) -> str:
        if said != SENTENCE:
            raise ValueError(f'write, word for word: "{SENTENCE}"')
        return said


class _Ros2(_Table):
    domain: Annotated[int, Field(ge=0, le=232)] = 0
    host: str = "127.0.0.1"
    peers: tuple[str, ...] = ("127.0.0.1",)

    @field_validator("host")
    @classmethod
    def _one_address(cls, host: str) -> str:
        try:
            address = ipaddress.IPv4Address(host)
        except ValueError as error:
            raise ValueError("give one IPv4 address of this machine, e.g. 127.0.0.1") from error
        if address.is_unspecified or address.is_multicast:
            raise ValueError(f"{host} stands for every address; name the one that faces the vehicle")
        return host

    @field_validator("peers")
    @classmethod
    def _addresses(cls, peers: tuple[str, ...]) -> tuple[str, ...]:
        for peer in peers:
            try:
                ipaddress.IPv4Address(peer)
            except ValueError as error:
                raise ValueError(f"{peer!r} is no IPv4 address") from error
        return peers

    @model_validator(mode="after")
    def _reachable(self) -> Self:
        elsewhere = [peer for peer in self.peers if not peer.startswith("127.")]
        if elsewhere and self.host.startswith("127."):
            raise ValueError(
                f"{elsewhere[0]} cannot reach {self.host}; give this machine's address that it can reach as host"
            )
        return self


class _Rosbridge(_Table):
    url: str = "ws://127.0.0.1:9090"


class _File(_Table):
    interface: Interface
    stack: Literal["autoware.ai", "autoware"] | None = None
    limits: _Limits
    messages: Package = "autoware_internal_planning_msgs"
    replanner: _Replanner | None = None
    constant_speed: _ConstantSpeed | None = None
    ros2: _Ros2 = _Ros2()
    rosbridge: _Rosbridge = _Rosbridge()

    @model_validator(mode="before")
    @classmethod
    def _not_ros1(cls, said: dict[str, object]) -> dict[str, object]:
        if said.get("interface") == "ros1" or "ros1" in said:
            raise ValueError(
                'a ROS 1 vehicle is reached through a rosbridge server: write interface = "rosbridge", '
                'stack = "autoware.ai" and [rosbridge] with url = "ws://HOST:9090", and take [ros1] out'
            )
        return said

    @model_validator(mode="after")
    def _together(self) -> Self:
        if self.interface == "ros2" and self.stack == "autoware.ai":
            raise ValueError("over ros2 the stack is autoware")
        if self.interface == "rosbridge" and self.stack is None:
            raise ValueError('behind rosbridge, say stack = "autoware.ai" (ROS 1) or "autoware" (ROS 2)')
        if self.is_autoware and (self.replanner or self.constant_speed):
            raise ValueError("[replanner] and [constant_speed] are of autoware.ai")
        return self

    @property
    def is_autoware(self) -> bool:
        return self.stack == "autoware" or self.interface == "ros2"


@dataclass(frozen=True, slots=True)
class VehicleSettings:
    """One vehicle, as its configuration file describes it.

    Attributes:
        interface: The way to it.
        stack: What is said to it.
        ros2, rosbridge: Where it is; the one of the interface counts.
    """

    interface: Interface
    stack: AutowareAi | Autoware
    ros2: Ros2Settings
    rosbridge: RosbridgeSettings


def read_settings(path: Path, today: datetime.date | None = None) -> VehicleSettings:
    """Read a vehicle's configuration file (TOML).

    Args:
        path: The file.
        today: The date an acknowledgement is judged by; default the machine's.

    Raises:
        ConfigError: The file cannot be read, has an unknown key or a value out of range, or its acknowledgement of a
            constant speed is not word for word, is over, or lasts too long.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"The vehicle file {path} cannot be read: {error}.") from error
    return parse_settings(text, str(path), today)


def parse_settings(text: str, name: str = "vehicle.toml", today: datetime.date | None = None) -> VehicleSettings:
    """As `read_settings`, from the file's text."""
    try:
        file = _File.model_validate(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{name} is no TOML: {error}.") from error
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "the file"
        words = first["msg"].removeprefix("Value error, ")
        raise ConfigError(f"{name}, {where}: {words}.", hint="See docs/ros.md.") from error
    limits = VehicleLimits(file.limits.max_speed_mps, file.limits.look_ahead_m, file.limits.look_ahead_ratio_s)
    return VehicleSettings(
        file.interface,
        Autoware(limits, file.messages) if file.is_autoware else _autoware_ai(file, limits, name, today),
        Ros2Settings(**file.ros2.model_dump()),
        RosbridgeSettings(**file.rosbridge.model_dump()),
    )


def _autoware_ai(file: _File, limits: VehicleLimits, name: str, today: datetime.date | None) -> AutowareAi:
    replanner = Replanner(planned_max_mps=limits.max_speed_mps, **(file.replanner or _Replanner()).model_dump())
    source = _source(file.constant_speed, name, today or datetime.datetime.now(tz=datetime.UTC).date())
    return AutowareAi(limits, replanner, source)


def _source(said: _ConstantSpeed | None, name: str, today: datetime.date) -> SpeedSource:
    if said is None:
        return PlannedSpeed()
    days = (said.until - today).days
    if days < 0:
        raise ConfigError(
            f"{name}: the acknowledgement of a constant speed ended on {said.until}.",
            hint="Remove [constant_speed], or have a person write it anew.",
        )
    if days > LONGEST_DAYS:
        raise ConfigError(
            f"{name}: an acknowledgement until {said.until} lasts {days} days.",
            hint=f"Let it last {LONGEST_DAYS} days at most.",
        )
    return ConstantSpeed(Acknowledgement(said.acknowledged_by, said.max_speed_mps))
