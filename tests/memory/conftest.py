"""A vault in a temporary directory, and what is recalled from it."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from memory_trips import Clock, chroma_memory, context

from chauffeur.concept import Instruction, PersonId
from chauffeur.memory import Memory, VaultMemory, cipher


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture(autouse=True)
def _no_passphrase(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CHAUFFEUR_PASSPHRASE", raising=False)


@pytest.fixture(scope="module")
def unsynced() -> Iterator[None]:
    """Files are not synced to the disk: many of them, and no power is cut."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cipher, "_PRAGMAS", tuple(one.replace("FULL", "OFF") for one in cipher._PRAGMAS))
        patch.setattr(os, "fsync", lambda descriptor: None)
        yield


@pytest.fixture
def vault(tmp_path: Path, clock: Clock) -> VaultMemory:
    return VaultMemory(tmp_path / "home", clock=clock)


@pytest.fixture(params=["vault", "chroma"])
def memory(request: pytest.FixtureRequest, tmp_path: Path, clock: Clock) -> Memory:
    """Each memory that ships, in turn."""
    home = tmp_path / "home"
    return VaultMemory(home, clock=clock) if request.param == "vault" else chroma_memory(home, clock)


@pytest.fixture
def wishes() -> Callable[..., list[str]]:
    """Wishes recalled for a person, nearest first."""

    def recall(memory: Memory, person: str, text: str = "Drive faster", k: int = 10) -> list[str]:
        history = memory.recall(PersonId(person), Instruction(text), context(), k)
        return [item.instruction for item in history.items]

    return recall
