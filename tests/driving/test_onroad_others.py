"""Wishes for Autoware over DDS, another process at the other end."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("websockets", reason="websockets is not installed: pip install 'chauffeur[ros]'")

sys.path.append(str(Path(__file__).resolve().parents[1] / "worlds"))

from rosbridge_server import eventually

from chauffeur.concept import Parameters
from chauffeur.driving.events import DriveEvent
from chauffeur.driving.onroad.session import VehicleSession
from chauffeur.planners.registry import make_planner
from chauffeur.worlds.ros.factory import open_vehicle
from chauffeur.worlds.ros.settings import parse_settings

pytestmark = pytest.mark.server


def drive(text: str, steps: Callable[[VehicleSession], Awaitable[None]]) -> list[DriveEvent]:
    told: list[DriveEvent] = []
    settings, planner = parse_settings(text), make_planner("talk2drive")
    car = open_vehicle(settings)

    async def whole() -> None:
        async with VehicleSession(car, settings, planner, tell=told.append, confirm_within_s=10.0) as road:
            assert (await road.reached(20.0)).link == "up"
            await steps(road)

    try:
        asyncio.run(whole())
    finally:
        car.close()
    return told


async def soon(true: Callable[[], Any]) -> Any:
    return await asyncio.to_thread(eventually, true, 20.0)


def test_autoware_gets_a_velocity_limit_and_its_own_speed_counts() -> None:
    pytest.importorskip("cyclonedds", reason="cyclonedds is not installed: pip install 'chauffeur[ros]'")
    from test_ros_dds import DOMAIN, planner

    async def steps(road: VehicleSession) -> None:
        await soon(lambda: road._vehicle.state().speed_mps and road._vehicle.state().mode)
        answer = await road.ask("A bit faster, please.")
        assert answer.status == "delivered", answer.words
        assert answer.plan is not None
        assert isinstance(answer.plan.policy, Parameters)
        asked = answer.plan.policy.target_speed_mps
        assert 2.5 < asked < 6.0  # it drives at 2.5 m/s
        await soon(lambda: autoware.got("Limit"))
        assert autoware.got("Limit")[0]["fields"]["max_velocity"] == pytest.approx(
            asked, abs=0.01
        )  # a whole tenth of a km/h

    with planner(mode=2) as autoware:
        told = drive(f'interface = "ros2"\n[limits]\nmax_speed_mps = 10.0\n[ros2]\ndomain = {DOMAIN}\n', steps)
    context = next(event.text for event in told if event.kind == "context")
    assert "I am driving at 2.5 m/s (9 km/h)." in context
    assert "Its mode of operation is: autonomous." in context
