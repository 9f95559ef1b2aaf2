"""Synthetic speech for sessions; tests that need a synthesiser skip where there is none."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable

import numpy as np
import pytest

from chauffeur.speech.audio import SAMPLE_RATE_HZ, decode


@pytest.fixture(scope="session")
def speech() -> Callable[[str], bytes]:
    """A sentence in a synthetic voice, half a second of quiet before it and a second behind, as 16 kHz PCM."""
    if shutil.which("espeak-ng") is None:
        pytest.skip("espeak-ng is not installed")
    pytest.importorskip("soxr", reason="needs the extra `speech`")

    def speak(text: str) -> bytes:
        command = ["espeak-ng", "--stdin", "--stdout", "-v", "en-us", "-s", "150"]
        done = subprocess.run(command, input=text.encode(), capture_output=True, timeout=30, check=True)
        sound = decode(done.stdout).samples.astype(np.float64)
        sound = 12_000.0 * sound / np.abs(sound).max()
        quiet = np.zeros(SAMPLE_RATE_HZ // 2)
        sound = np.concatenate([quiet, sound, quiet, quiet])
        noise = np.random.default_rng(1).normal(0.0, 60.0, len(sound))
        return (sound + noise).astype("<i2").tobytes()

    return speak
