"""The ROS 1 client against the real ROS: Debian's roscore, rospy nodes, rostopic and rosnode. Skipped where absent."""

from __future__ import annotations

import shlex
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

import pytest

pytest.importorskip("rosbags", reason="rosbags is not installed: pip install 'chauffeur[ros]'")

import ros_debian as debian
import ros_graph as ros
from ros_debian import LISTENER, SPEEDOMETER, Node, rospy_node, tool
from ros_graph import eventually

from chauffeur.concept import Parameters
from chauffeur.worlds.ros import VehicleLimits
from chauffeur.worlds.ros.autoware_ai import AutowareAi, Replanner
from chauffeur.worlds.ros.dry import DryRun
from chauffeur.worlds.ros.node import Ros1Settings
from chauffeur.worlds.ros.ros1 import Ros1Vehicle

pytestmark = [
    pytest.mark.server,
    pytest.mark.slow,
    pytest.mark.skipif(bool(debian.missing()), reason=debian.missing() or "ROS 1 is here"),
]

STACK = AutowareAi(VehicleLimits(15.0, (4.0, 20.0)), Replanner(planned_max_mps=12.0))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return debian.make_packages(tmp_path_factory.mktemp("ros"))


@pytest.fixture(scope="module")
def port(folder: Path) -> Iterator[int]:
    free = ros.free_port()
    with debian.roscore(folder, free):
        yield free


@pytest.fixture(scope="module")
def follower(folder: Path, port: int) -> Iterator[Node]:
    with rospy_node(LISTENER, folder, port, "pure_pursuit", "follower") as node:
        yield node


@pytest.fixture(scope="module")
def replanner(folder: Path, port: int) -> Iterator[Node]:
    with rospy_node(LISTENER, folder, port, "waypoint_replanner", "replanner") as node:
        yield node


@pytest.fixture
def car(port: int) -> Iterator[Ros1Vehicle]:
    vehicle = Ros1Vehicle(STACK, Ros1Settings(master=f"http://{ros.HOST}:{port}", node="/chauffeur"), check_s=0.2)
    yield vehicle
    vehicle.close()


def same(fields: dict[str, Any], others: dict[str, Any]) -> bool:
    return fields == {name: pytest.approx(value) for name, value in others.items()}


def test_rospy_nodes_get_every_field(
    folder: Path, port: int, car: Ros1Vehicle, follower: Node, replanner: Node
) -> None:
    eventually(lambda: car.state().link == "up")
    published = car.apply(Parameters(10.0, 8.0, 2.0))
    eventually(lambda: follower.got and replanner.got)
    assert same(replanner.got[0]["fields"], dict(published.messages[0].fields))
    assert same(follower.got[0]["fields"], dict(published.messages[1].fields))
    assert follower.got[0]["fields"]["param_flag"] == 0
    assert 0 <= follower.got[0]["came"] - follower.got[0]["stamp"] < 1.0
    assert "autoware_config_msgs/ConfigWaypointFollower" in tool(["rosnode", "info", "/chauffeur"], folder, port)
    seen = len(follower.got)
    for number in range(200):  # one every 2 ms
        car.apply(Parameters(number / 20, 8.0, 2.0))
        time.sleep(0.002)
    eventually(lambda: follower.got[-1]["fields"]["velocity"] == pytest.approx(199 / 20 * 3.6))
    got = follower.got[seen:]
    speeds = [one["fields"]["velocity"] for one in got]
    assert speeds == sorted(set(speeds))
    assert len(got) >= 100  # a wish replaced before it went out is no loss
    assert median(one["came"] - one["stamp"] for one in got) < 0.05


def test_the_lines_of_a_dry_run_publish_the_same(
    folder: Path, port: int, car: Ros1Vehicle, follower: Node, replanner: Node
) -> None:
    dry = DryRun(replace(STACK, replanner=replace(STACK.replanner, slow_in_curves=False)))
    published = dry.apply(Parameters(7.3, 9.5, 1.5))
    seen = len(follower.got), len(replanner.got)
    commands = [shlex.split(line) for line in dry.lines]
    assert [words[0] for words in commands] == ["rostopic", "rostopic"]
    with ThreadPoolExecutor() as both:
        list(both.map(lambda words: tool(["/usr/bin/rostopic", *words[1:]], folder, port), commands))
    eventually(lambda: len(follower.got) > seen[0] and len(replanner.got) > seen[1])
    assert same(replanner.got[seen[1]]["fields"], dict(published.messages[0].fields))
    assert same(follower.got[seen[0]]["fields"], dict(published.messages[1].fields))
    assert abs(follower.got[seen[0]]["came"] - follower.got[seen[0]]["stamp"]) < 5.0  # `header: auto`
    assert car.state().link == "up"  # and our own node goes on beside rostopic's


def test_the_speed_of_a_rospy_publisher_is_read(folder: Path, port: int, car: Ros1Vehicle) -> None:
    if not debian.has_geometry():
        pytest.skip("no geometry_msgs for rospy here: apt-get install python3-geometry-msgs")
    with rospy_node(SPEEDOMETER, folder, port, "3.25"):
        eventually(lambda: car.state().speed_mps == 3.25)
    eventually(lambda: car.state().speed_mps is None)


def test_rosnode_kill_ends_it_in_words(folder: Path, port: int, car: Ros1Vehicle) -> None:
    eventually(lambda: dict(car.state().counts).get("registrations"))
    tool(["rosnode", "kill", "/chauffeur"], folder, port)
    state = eventually(lambda: (seen := car.state()).link == "replaced" and seen)
    assert "user request" in state.words


def test_a_master_that_dies_and_comes_back(folder: Path) -> None:
    port = ros.free_port()
    with debian.rosmaster(folder, port):
        car = Ros1Vehicle(STACK, Ros1Settings(master=f"http://{ros.HOST}:{port}"), check_s=0.1)
        with rospy_node(LISTENER, folder, port, "pure_pursuit", "follower") as old:
            eventually(lambda: (seen := dict(car.state().counts)).get("subscribers") and seen.get("registrations"))
            car.apply(Parameters(4.0, 8.0, 2.0))
            eventually(lambda: old.got)
    eventually(lambda: "refused" in " ".join(car.state().notes))
    car.apply(Parameters(5.0, 8.0, 2.0))
    with debian.rosmaster(folder, port), rospy_node(LISTENER, folder, port, "pure_pursuit", "follower") as fresh:
        eventually(lambda: fresh.got)
        assert fresh.got[0]["fields"]["velocity"] == pytest.approx(18.0)
        eventually(lambda: dict(car.state().counts)["registrations"] == 2)
        car.close()
