"""Autoware over DDS, process to process: another process stands for the vehicle, with type definitions of its own."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import pytest

pytest.importorskip("cyclonedds", reason="cyclonedds is not installed: pip install 'chauffeur[ros]'")
pytest.importorskip("rosbags", reason="rosbags is not installed: pip install rosbags")

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbridge_server import eventually, wish

from chauffeur.concept import Parameters
from chauffeur.worlds.ros import VehicleError, VehicleInterface, VehicleLimits, VehicleRefusalError
from chauffeur.worlds.ros.autoware import CANDIDATE_TOPIC, CLEAR_TOPIC, Autoware, definitions
from chauffeur.worlds.ros.ros2 import Ros2Settings, Ros2Vehicle

pytestmark = pytest.mark.server

DOMAIN = 90 + os.getpid() % 10
"""Not ROS's own default, and most likely not another run's."""

STACK = Autoware(VehicleLimits(15.0))

PLANNER = r'''
import json, sys, time
from dataclasses import dataclass
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float32, int32, uint16, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32

@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str

@dataclass
class Constraints(IdlStruct, typename="autoware_internal_planning_msgs::msg::dds_::VelocityLimitConstraints_"):
    max_acceleration: float32
    min_acceleration: float32
    max_jerk: float32
    min_jerk: float32

@dataclass
class Limit(IdlStruct, typename="autoware_internal_planning_msgs::msg::dds_::VelocityLimit_"):
    stamp: Time
    max_velocity: float32
    use_constraints: bool
    constraints: Constraints
    sender: str

@dataclass
class Clear(IdlStruct, typename="autoware_internal_planning_msgs::msg::dds_::VelocityLimitClearCommand_"):
    stamp: Time
    command: bool
    sender: str

@dataclass
class Mode(IdlStruct, typename="autoware_adapi_v1_msgs::msg::dds_::OperationModeState_"):
    stamp: Time
    mode: uint16
    is_autoware_control_enabled: bool
    is_in_transition: bool
    is_stop_mode_available: bool
    is_autonomous_mode_available: bool
    is_local_mode_available: bool
    is_remote_mode_available: bool

@dataclass
class Velocity(IdlStruct, typename="autoware_vehicle_msgs::msg::dds_::VelocityReport_"):
    header: Header
    longitudinal_velocity: float32
    lateral_velocity: float32
    heading_rate: float32

DOMAIN, DURABILITY, MODE, SPEED = int(sys.argv[1]), sys.argv[2], int(sys.argv[3]), float(sys.argv[4])
domain = Domain(DOMAIN, """<CycloneDDS><Domain><General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>
<MaxAutoParticipantIndex>120</MaxAutoParticipantIndex>
<LeaseDuration>1 s</LeaseDuration><Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>""")
participant = DomainParticipant(DOMAIN)
reliable = Policy.Reliability.Reliable(max_blocking_time=duration(milliseconds=100))
durability = {"kept": Policy.Durability.TransientLocal, "persistent": Policy.Durability.Persistent}[DURABILITY]
quality = Qos(reliable, durability, Policy.History.KeepLast(10))
kept = Qos(reliable, Policy.Durability.TransientLocal, Policy.History.KeepLast(1))
fleeting = Qos(Policy.Reliability.BestEffort, Policy.Durability.Volatile, Policy.History.KeepLast(1))
def topic(name, kind):
    return Topic(participant, "rt" + name, kind)
limits = DataReader(participant, topic("/planning/scenario_planning/max_velocity_candidates", Limit), qos=quality)
clears = DataReader(participant, topic("/planning/scenario_planning/clear_velocity_limit", Clear), qos=quality)
mode = DataWriter(participant, topic("/api/operation_mode/state", Mode), qos=kept)
current = DataWriter(participant, topic("/planning/scenario_planning/current_max_velocity", Limit), qos=kept)
velocity = DataWriter(participant, topic("/vehicle/status/velocity_status", Velocity), qos=fleeting)
stamp = Time(1, 2)
mode.write(Mode(stamp, MODE, True, False, True, True, False, False))
current.write(Limit(stamp, 4.0, False, Constraints(0, 0, 0, 0), "api"))
print(json.dumps({"ready": True}), flush=True)
said = 0.0
while True:
    for reader in (limits, clears):
        for sample in reader.take(N=100):
            if sample.sample_info.valid_data:
                fields = {k: v for k, v in vars(sample).items() if isinstance(v, (bool, int, float, str))}
                stamp_s = sample.stamp.sec + sample.stamp.nanosec / 1e9
                print(json.dumps({"kind": type(sample).__name__, "cdr": sample.serialize().hex(), "fields": fields,
                                  "stamp": [sample.stamp.sec, sample.stamp.nanosec], "late": time.time() - stamp_s}),
                      flush=True)
    if time.monotonic() - said > 0.05:
        said = time.monotonic()
        velocity.write(Velocity(Header(stamp, "base_link"), SPEED, 0.0, 0.0))
    time.sleep(0.0005)
'''


class Planner:
    """The other process."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        self.said: list[dict[str, Any]] = []
        threading.Thread(target=self._read, daemon=True).start()
        eventually(lambda: self.said, within_s=20.0)

    def got(self, kind: str) -> list[dict[str, Any]]:
        return [one for one in self.said if one.get("kind") == kind]

    def _read(self) -> None:
        for line in self.process.stdout or ():
            self.said.append(json.loads(line))


@contextmanager
def planner(durability: str = "kept", mode: int = 1, speed_mps: float = 2.5) -> Iterator[Planner]:
    command = [sys.executable, "-c", PLANNER, str(DOMAIN), durability, str(mode), str(speed_mps)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True)
    try:
        yield Planner(process)
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait(timeout=10)


def cdr(type_name: str, fields: dict[str, Any]) -> bytes:
    """Bytes of a message, by `rosbags`, another implementation of the same encoding."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    for name, definition in definitions("autoware_internal_planning_msgs").items():
        store.register(get_types_from_msg("".join(f"{kind} {field}\n" for kind, field in definition), name))

    def built(name: str, fields: dict[str, Any]) -> Any:
        inner = {field: str(kind[1]) for field, kind in store.fielddefs[name][1]}
        values = {field: built(inner[field], v) if isinstance(v, dict) else v for field, v in fields.items()}
        return store.types[name](**values)

    return bytes(store.serialize_cdr(built(type_name, fields), type_name))


@pytest.fixture
def car() -> Iterator[Ros2Vehicle]:
    vehicle = Ros2Vehicle(STACK, Ros2Settings(domain=DOMAIN))
    yield vehicle
    vehicle.close()


def test_a_wish_is_a_velocity_limit_of_our_own_sender_byte_for_byte(car: Ros2Vehicle) -> None:
    assert isinstance(car, VehicleInterface)
    with planner(mode=2) as vehicle:
        eventually(lambda: car.state().link == "up", within_s=10.0)
        published = car.apply(wish(4.0))
        eventually(lambda: vehicle.got("Limit") and vehicle.got("Clear"))
        assert vehicle.got("Limit")[0]["fields"] == {
            "max_velocity": 4.0,
            "use_constraints": False,
            "sender": "chauffeur",
        }
        assert vehicle.got("Clear")[0]["fields"] == {"command": False, "sender": "chauffeur"}
        assert {message.topic for message in published.messages} == {CANDIDATE_TOPIC, CLEAR_TOPIC}
        for message, kind in zip(published.messages, ("Clear", "Limit"), strict=True):
            seen = vehicle.got(kind)[0]
            stamp = {"sec": seen["stamp"][0], "nanosec": seen["stamp"][1]}
            assert cdr(message.type, {"stamp": stamp, **message.fields}).hex() == seen["cdr"]
        state = eventually(lambda: (now := car.state()).speed_mps and now.mode and now.delivered and now)
        assert state.speed_mps == 2.5
        assert state.mode == "autonomous"
        eventually(lambda: "limit in force is 14.4 km/h" in car.state().words)
        seen = len(vehicle.got("Limit"))
        for number in range(100):
            car.apply(wish(number / 10))
            time.sleep(0.002)
        eventually(lambda: vehicle.got("Limit")[-1]["fields"]["max_velocity"] == pytest.approx(9.9, abs=1e-5))
        late = sorted(one["late"] for one in vehicle.got("Limit")[seen:])
        assert late[len(late) // 2] < 0.05
        car.release()
        eventually(lambda: vehicle.got("Clear")[-1]["fields"]["command"] is True)
        eventually(lambda: vehicle.got("Limit")[-1]["fields"]["max_velocity"] == 15.0)


def test_who_comes_late_gets_the_newest_and_who_goes_is_missed(car: Ros2Vehicle) -> None:
    eventually(lambda: car.state().link == "waiting", within_s=10.0)
    assert "Nobody listens to /planning/scenario_planning/max_velocity_candidates" in car.state().words
    for speed in (5.0, 6.0, 7.0):
        begun = time.perf_counter()
        car.apply(wish(speed))
        assert time.perf_counter() - begun < 0.1
    for _ in range(2):  # the second is a planner started anew
        with planner() as vehicle:
            eventually(lambda vehicle=vehicle: vehicle.got("Limit") and vehicle.got("Clear"), within_s=10.0)
            assert [one["fields"]["max_velocity"] for one in vehicle.got("Limit")] == [7.0]
            assert [one["fields"]["command"] for one in vehicle.got("Clear")] == [False]
            eventually(lambda: car.state().link == "up")
            vehicle.process.send_signal(signal.SIGTERM)
            vehicle.process.wait(timeout=10)
            eventually(lambda: car.state().link == "waiting", within_s=20.0)
    eventually(lambda: car.state().speed_mps is None)


def test_another_quality_of_service_is_said(car: Ros2Vehicle) -> None:
    with planner(durability="persistent"):
        words = eventually(lambda: (now := car.state()).link == "refused" and now.words, within_s=10.0)
        assert "quality of service" in words


def test_a_graph_that_cannot_be_joined_is_said_and_holds_nobody_up() -> None:
    car = Ros2Vehicle(STACK, Ros2Settings(domain=DOMAIN + 10, host="192.0.2.1"))
    eventually(lambda: "cannot be joined on 192.0.2.1" in car.state().words, within_s=10.0)
    begun = time.perf_counter()
    car.apply(wish(3.0))
    assert time.perf_counter() - begun < 0.1
    assert car.state().link == "connecting"
    car.close()
    assert car.state().link == "closed"
    with pytest.raises(VehicleError, match="closed"):
        car.apply(wish(3.0))


def test_what_is_refused_is_not_written(car: Ros2Vehicle) -> None:
    for bad in (wish(15.1), wish(float("nan")), Parameters(3.0, 8.0, 2.0, lane=1)):
        with pytest.raises(VehicleRefusalError):
            car.apply(bad)
    assert "published" not in dict(car.state().counts)
