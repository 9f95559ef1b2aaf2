"""Listening beside a session on a vehicle: what goes wrong with it ends listening, and nothing else."""

from __future__ import annotations

import asyncio

import pytest

from chauffeur.concept import ChauffeurError
from chauffeur.driving.onroad.spoken import listening
from chauffeur.driving.talk.asr_process import AsrEngine
from chauffeur.driving.talk.attention import Attention
from chauffeur.driving.talk.messages import Said


def attention(engine: AsrEngine | None, said: list[Said]) -> Attention:
    return Attention(engine, None, None, said.append, lambda hotword, words: None)


def test_an_engine_that_cannot_be_had_is_said_before_anything_is_listened_to() -> None:
    async def session() -> None:
        async with listening(attention(AsrEngine("whisper", "/nowhere"), []), print):
            raise AssertionError

    with pytest.raises(ChauffeurError):
        asyncio.run(session())


def test_a_fault_of_hearing_is_told_and_the_session_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[str] = []

    def fails() -> None:
        raise RuntimeError("out of paper")

    async def session() -> str:
        ears = attention(None, [])
        monkeypatch.setattr(ears, "poll", fails)
        async with listening(ears, told.append):
            while not told:
                await asyncio.sleep(0.01)
            return "went on"

    assert asyncio.run(session()) == "went on"
    assert told == ["Listening broke off: out of paper. Type what you want."]
