"""A memory that fails: said, and driven without."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from memory_trips import Clock, context, trip

from chauffeur.concept import History, Instruction, Limits, PersonId
from chauffeur.driving.events import DriveEvent
from chauffeur.driving.scenarios import find
from chauffeur.driving.session import Session
from chauffeur.memory import VaultMemory
from chauffeur.memory.tolerant import TolerantMemory
from chauffeur.planners.registry import make_planner

pytestmark = pytest.mark.usefixtures("unsynced")

ANN, BEN = PersonId("Ann"), PersonId("Ben")


@pytest.fixture
def vault(tmp_path: Path) -> VaultMemory:
    """Ann's profile is cut in half, Ben's is whole."""
    vault = VaultMemory(tmp_path, clock=Clock())
    for name in ("Ann", "Ben"):
        vault.remember(trip(name, "drive faster"))
    vault.close()
    alias = VaultMemory(tmp_path)._ring.alias(ANN)
    path = tmp_path / "profiles" / f"{alias}.db"
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    return VaultMemory(tmp_path, clock=Clock())


def test_a_damaged_profile_recalls_nothing_and_says_so(vault: VaultMemory) -> None:
    told: list[str] = []
    memory = TolerantMemory(vault, told.append)
    assert memory.recall(ANN, Instruction("drive faster", ANN), context(), 3) == History()
    assert len(told) == 1
    assert told[0].startswith("Nothing is recalled of Ann: ")
    memory.remember(trip("Ann", "slow down"))
    assert told[1].startswith("This trip is not kept for Ann: ")


def test_anothers_damage_is_nobody_elses(vault: VaultMemory) -> None:
    told: list[str] = []
    memory = TolerantMemory(vault, told.append)
    memory.remember(trip("Ben", "drive faster", id="second"))
    assert len(memory.recall(BEN, Instruction("drive faster", BEN), context(), 3).items) == 2
    assert told == []


def test_a_drive_goes_on_without_it(vault: VaultMemory) -> None:
    told: list[DriveEvent] = []
    session = Session(
        planner=make_planner("keyword"),
        memory=vault,
        tell=told.append,
        max_s=2.0,
    )
    place = find("intersection")
    recorded = asyncio.run(session.drive(Instruction("Turn right.", ANN), place, place.seed, Limits()))
    assert recorded.frames
    assert [event.text.split(":")[0] for event in told if event.kind == "trouble"] == [
        "Nothing is recalled of Ann",
        "This trip is not kept for Ann",
    ]
