"""Words to a real ROS 1: Debian's roscore and rospy subscribers, and the on-board planner. Skipped where absent."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path

import pytest

pytest.importorskip("rosbags", reason="rosbags is not installed: pip install 'chauffeur[ros]'")

sys.path.append(str(Path(__file__).resolve().parents[1] / "worlds"))

import ros_debian as debian
import ros_graph as ros
from ros_debian import LISTENER, rospy_node

from chauffeur.concept import PersonId
from chauffeur.drive.events import DriveEvent
from chauffeur.drive.onroad import OnRoadAnswer, VehicleSession, open_recorder
from chauffeur.memory.vault import VaultMemory
from chauffeur.planners.registry import make_planner
from chauffeur.safety.audit import read_records, verify
from chauffeur.worlds.ros.factory import open_vehicle
from chauffeur.worlds.ros.settings import read_settings

pytestmark = [
    pytest.mark.server,
    pytest.mark.slow,
    pytest.mark.skipif(bool(debian.missing()), reason=debian.missing() or "ROS 1 is here"),
]


def test_a_session_over_a_roscore_that_dies(tmp_path: Path) -> None:
    folder, port = debian.make_packages(tmp_path / "ros"), ros.free_port()
    file = tmp_path / "vehicle.toml"
    file.write_text(
        f'interface = "ros1"\n[limits]\nmax_speed_mps = 10.0\n[ros1]\nmaster = "http://{ros.HOST}:{port}"\n'
    )
    settings, planner = read_settings(file), make_planner("talk2drive")
    memory, ana = VaultMemory(tmp_path / "home"), PersonId("ana")
    answers: list[OnRoadAnswer] = []
    told: list[DriveEvent] = []

    async def eventually(true: object) -> None:
        await asyncio.to_thread(ros.eventually, true, 20.0)

    async def whole() -> None:
        car = open_vehicle(settings)
        with open_recorder(tmp_path / "audit.jsonl", file, settings.interface, dry_run=False) as books:
            async with VehicleSession(
                car, settings, planner, person=ana, memory=memory, books=books, tell=told.append
            ) as road:
                with (
                    debian.rosmaster(folder, port),
                    rospy_node(LISTENER, folder, port, "pure_pursuit", "follower") as follower,
                    rospy_node(LISTENER, folder, port, "waypoint_replanner", "replanner") as replanner,
                ):
                    assert (await road.reached(20.0)).link == "up"
                    answers.append(await road.ask("Drive at 20 km/h."))
                    await eventually(lambda: follower.got and replanner.got)
                    assert replanner.got[0]["fields"]["velocity_max"] == pytest.approx(20.016)
                    assert follower.got[0]["fields"]["param_flag"] == 0
                    answers.append(await road.evaluate("a bit too slow"))
                await eventually(lambda: car.state().link == "connecting")
                answers.append(await road.ask("Drive at 30 km/h."))
                with (
                    debian.rosmaster(folder, port),
                    rospy_node(LISTENER, folder, port, "pure_pursuit", "follower") as follower,
                    rospy_node(LISTENER, folder, port, "waypoint_replanner", "replanner") as replanner,
                ):
                    assert (await road.reached(20.0)).link == "up"
                    await eventually(lambda: replanner.got)
                    assert replanner.got[0]["fields"]["velocity_max"] == pytest.approx(20.016)
                    answers.append(await road.ask("stop"))
                    await eventually(lambda: len(replanner.got) == 2)
                    assert replanner.got[1]["fields"]["velocity_max"] == 0.0
        car.close()

    asyncio.run(whole())
    assert [one.status for one in answers] == ["delivered", "taken", "unreachable", "delivered"]
    assert any("connection is refused" in event.text for event in told if event.kind == "link")
    assert verify(tmp_path / "audit.jsonl").ok
    acts = [r.body for _, r in read_records(tmp_path / "audit.jsonl") if r.kind == "actuation"]
    assert [(one["wish"], one["done"]) for one in acts] == [(1, False), (1, True), (4, False), (4, True)]
    assert '"outcome": "ended"' in memory.export(ana)
