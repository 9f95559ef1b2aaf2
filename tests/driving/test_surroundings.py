"""Weather and rules of a real place in a simulated drive's C."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from chauffeur.concept import Instruction, Limits
from chauffeur.describe import describe
from chauffeur.describe.services.sources import Sources, read_sources
from chauffeur.driving.scenarios import find
from chauffeur.driving.session import Session
from chauffeur.driving.surroundings import SERVICES_FILE, describing, services_file
from chauffeur.planners.registry import make_planner
from chauffeur.worlds.highway import HighwayWorld

FILE = """
region = "germany"
[position]
at = [48.137, 11.575]
heading_deg = 90
"""


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("CHAUFFEUR_HOME", str(tmp_path))
    (tmp_path / SERVICES_FILE).write_text(FILE)
    return tmp_path / SERVICES_FILE


def test_without_the_file_nobody_is_asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CHAUFFEUR_HOME", str(tmp_path))
    assert services_file() is None


def test_a_simulated_car_has_real_weather_and_rules_and_its_own_road(file: Path) -> None:
    assert services_file() == file
    observation = HighwayWorld().reset(find("cruise"))

    async def made() -> str:
        async with Sources(read_sources(file)) as sources:
            return (await describing(sources))(observation).text

    text = asyncio.run(made())
    assert text.startswith(describe(observation).text)
    assert "Traffic rules" in text
    assert "Weather: not known" in text  # said, and not invented
    assert "Road:" not in text
    assert text.count("Speed limit") == describe(observation).text.count("Speed limit")


def test_a_drive_is_told_of_it(file: Path) -> None:
    place = find("cruise")
    session = Session(planner=make_planner("keyword"), sources=read_sources(file), max_s=1.0)
    recorded = asyncio.run(session.drive(Instruction("Slow down."), place, place.seed, Limits()))
    assert "Traffic rules" in recorded.trip.context.text
