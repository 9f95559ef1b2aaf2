"""Trips to remember, and a clock that is set by hand."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from chauffeur.concept import (
    Causes,
    Context,
    History,
    Instruction,
    PersonId,
    Plan,
    Policy,
    Program,
    Situation,
    Thoughts,
    Trip,
)
from chauffeur.memory.chroma import ChromaMemory


@dataclass
class Clock:
    now: datetime = field(default_factory=lambda: datetime(2026, 3, 1, 12, tzinfo=UTC))

    def __call__(self) -> datetime:
        return self.now

    def pass_by(self, **time: float) -> None:
        self.now += timedelta(**time)


def context(world: str = "highway", text: str = "I am driving at 30.0 m/s.") -> Context:
    return Context(text, Situation(world, 30.0, 31.3, 3, 1, False, None, None))


def trip(
    person: str,
    text: str,
    *,
    id: str = "t1",
    world: str = "highway",
    policy: Policy | None = None,
    thoughts: str = "",
    where: str = "I am driving at 30.0 m/s.",
    settings: tuple[tuple[str, float], ...] = (("target_speed_mps", 28.0),),
) -> Trip:
    plan = Plan(Thoughts(thoughts), policy or Program("def p():\n    yield autopilot()"), intent="x", settings=settings)
    return Trip(
        id, Instruction(text, PersonId(person)), context(world, where), History(), plan, (), "success", Causes(), (),
        12.0, "s", 1,
    )  # fmt: skip


def chroma_memory(home: Path, clock: Clock) -> ChromaMemory:
    """An empty memory in Chroma; skips the test where that is not installed."""
    pytest.importorskip("chromadb", reason="Chroma is not installed: pip install 'chauffeur[chroma]'")
    return ChromaMemory(home, clock=clock)
