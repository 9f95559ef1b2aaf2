"""Engines are loaded once; tests that need a library or a program that is not here say which one, and skip."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import voices
from loudness import Loudness

from chauffeur.speech.audio import Samples


@pytest.fixture
def loudness() -> Loudness:
    return Loudness()


@pytest.fixture(scope="session")
def grammar_engine():
    pytest.importorskip("pocketsphinx", reason="needs the extra `speech`")
    from chauffeur.speech.grammar import GrammarRecogniser

    return GrammarRecogniser()


@pytest.fixture(scope="session")
def spoken() -> Callable[..., Samples]:
    """Synthetic speech in a quiet cabin; the same sentence is synthesised once."""
    pytest.importorskip("soxr", reason="needs the extra `speech`")
    kept: dict[tuple[object, ...], Samples] = {}

    def speak(text: str, voice: str = "flite/slt", snr_db: float | None = 30.0, speed: float = 1.0) -> Samples:
        if not voices.installed(voice):
            pytest.skip(f"the synthesiser of {voice} is not installed")
        key = (text, voice, snr_db, speed)
        if key not in kept:
            kept[key] = voices.in_cabin(voices.speak(text, voice, speed), np.random.default_rng(1), snr_db)
        return kept[key].copy()

    return speak
