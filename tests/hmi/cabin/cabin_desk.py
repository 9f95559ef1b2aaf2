"""A tab to work at, and a synthetic voice that speaks into its microphone."""

from __future__ import annotations

import shutil
import subprocess
import wave
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from chromium import Tab

SAID = "drive at sixty five miles per hour"
SAID_MPS = 65 * 0.44704


@dataclass
class Desk:
    """A tab, and a loop on which it is used.

    Attributes:
        said_bytes: How much sound the sentence is that its microphone hears, over and over; 0 where nobody can speak.
    """

    tab: Tab
    run: Callable[[Awaitable[None]], None]
    said_bytes: int


def spoken(path: Path) -> int:
    """A synthetic voice that says `SAID` between pauses, as WAV; how many bytes at 16 kHz, 0 without a voice."""
    raw = path.with_suffix(".raw.wav")
    if shutil.which("flite"):
        subprocess.run(["flite", "-voice", "slt", "-t", SAID, "-o", str(raw)], check=True, timeout=30)
    elif shutil.which("espeak-ng"):
        subprocess.run(["espeak-ng", "-v", "en-us", "-w", str(raw), SAID], check=True, timeout=30)
    else:
        return 0
    with wave.open(str(raw)) as voice:
        rate = voice.getframerate()
        samples = np.frombuffer(voice.readframes(voice.getnframes()), np.int16)
    pause = np.zeros(rate * 6 // 10, np.int16)
    samples = np.concatenate([pause, samples, pause, pause])
    with wave.open(str(path), "wb") as out:
        out.setnchannels(1)
        out.setsampwidth(2)
        out.setframerate(rate)
        out.writeframes(samples.tobytes())
    return len(samples) * 32_000 // rate
