"""The view from the seat: who looks gets pictures, they are shown, and what was seen in them is remembered."""

from __future__ import annotations

import asyncio
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("osqp")
pytest.importorskip("vehiclemodels")

from chauffeur.bench.motion.items import MotionItem, commands
from chauffeur.cli.drive import save_trip
from chauffeur.concept import Limits, PersonId, Plan, PlanRequest
from chauffeur.driving.episode import make_world
from chauffeur.driving.scenarios import find
from chauffeur.driving.seat import SeatCamera
from chauffeur.driving.session import Session, parse_wish
from chauffeur.memory.records import body_of, item_of
from chauffeur.planners.motion import FixedGainsPlanner


class Looker(FixedGainsPlanner):
    """Fixed gains, and a word on how bright it is."""

    sees = True

    async def plan(self, request: PlanRequest) -> Plan:
        (image,) = request.images
        return replace(await super().plan(request), scene=f"Mean {image.pixels().mean():.0f}.")


def test_who_looks_is_shown_the_weather_of_the_world_and_what_it_saw_is_kept(tmp_path: Path) -> None:
    told: list[str] = []
    session = Session(Looker(), tell=lambda event: told.append(event.kind), max_s=0.3)
    wish = parse_wish("Gently.", PersonId("ana"))
    recorded = asyncio.run(session.drive(wish, find("track-left-turn"), 1, Limits()))
    assert recorded.view is not None and told.index("view") < told.index("plan")
    assert recorded.view.pixels().mean() > 120  # snow, by day
    item = item_of("t", "2026-01-01", "track", body_of(recorded.trip), ())
    assert recorded.trip.plan.scene in item.context and recorded.trip.context.text in item.context  # C of Eq. 23
    names = {path.name for path in save_trip(tmp_path, recorded)}
    assert "view.png" in names
    page = (tmp_path / "trip.html").read_text(encoding="utf-8")
    assert "data:image/png;base64," in page and "View from the seat" in page


def test_who_does_not_look_costs_no_picture() -> None:
    session = Session(FixedGainsPlanner(), max_s=0.2)
    recorded = asyncio.run(session.drive(parse_wish("Gently.", PersonId("")), find("track-left-turn"), 1, Limits()))
    assert recorded.view is None and recorded.trip.plan.scene == ""
    assert json.loads(body_of(recorded.trip))["context"] == recorded.trip.context.text


def test_a_camera_shows_the_weather_it_is_told_to() -> None:
    world = make_world(find("track-left-turn"))
    observation = world.reset(find("track-left-turn"))
    own, night = (SeatCamera(world, 5, weather).take(observation)[0].pixels() for weather in (None, "night"))
    assert own.mean() > 2 * night.mean()


def test_the_benchmarks_controls_show_nothing_or_another_weather() -> None:
    item = MotionItem(commands()[0], "snow", "std", 1)
    assert item.shown("off") == ()
    (own,), (black,), (other,) = (item.shown(shown) for shown in ("on", "black", "other"))
    assert black.pixels().max() == 0 and not np.array_equal(own.pixels(), other.pixels())
    (sunny,) = MotionItem(commands()[0], "sunny", "std", 1).shown("on")
    assert np.array_equal(sunny.pixels(), other.pixels())  # the same place in the sun
