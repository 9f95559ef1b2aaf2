"""Synthetic voices and cabin noise for tests and the benchmark. Everything here is synthetic and says so."""

from __future__ import annotations

import shutil
import subprocess

import numpy as np
import numpy.typing as npt

from chauffeur.speech.audio import SAMPLE_RATE_HZ, Samples, decode, to_float, to_int16

SECOND = SAMPLE_RATE_HZ


def installed(voice: str) -> bool:
    """Whether the program of a voice such as `espeak/en-us` or `flite/slt` is here."""
    return shutil.which("espeak-ng" if voice.startswith("espeak/") else "flite") is not None


def speak(text: str, voice: str = "flite/slt", speed: float = 1.0) -> Samples:
    """A sentence in a synthetic voice. Speed 1 is the voice's own."""
    program, _, name = voice.partition("/")
    if program == "espeak":
        command = ["espeak-ng", "--stdin", "--stdout", "-v", name, "-s", str(round(160 * speed))]
    else:
        stretch = f"duration_stretch={1.0 / speed:.3f}"
        command = ["flite", "-voice", name, "--setf", stretch, "-o", "/dev/stdout", "-t", text]
    done = subprocess.run(command, input=text.encode(), capture_output=True, timeout=30, check=True)
    return decode(done.stdout).samples


def cabin_noise(length: int, rng: np.random.Generator) -> npt.NDArray[np.float32]:
    """Noise of a rolling car: most of it below some 300 Hz, a little of it everywhere, RMS 1."""
    white = np.fft.rfft(rng.standard_normal(length))
    hz = np.fft.rfftfreq(length, 1 / SAMPLE_RATE_HZ)
    shaped = np.fft.irfft(white / (1.0 + (hz / 300.0) ** 1.5), length)
    return np.asarray(shaped / np.sqrt(np.mean(shaped**2)), np.float32)


def in_cabin(
    speech: Samples,
    rng: np.random.Generator,
    snr_db: float | None = None,
    *,
    before_s: float = 0.5,
    after_s: float = 1.0,
) -> Samples:
    """Speech with pauses around it, peak 0.4, and noise at a ratio of speech to noise; None for none."""
    sound = to_float(speech)
    sound *= 0.4 / max(1e-6, float(np.abs(sound).max()))
    power = float(np.mean(sound[np.abs(sound) > 0.01] ** 2)) if np.any(np.abs(sound) > 0.01) else 1.0
    sound = np.concatenate(
        [np.zeros(int(before_s * SECOND), np.float32), sound, np.zeros(int(after_s * SECOND), np.float32)]
    )
    if snr_db is not None:
        sound += cabin_noise(len(sound), rng) * np.float32(np.sqrt(power / 10 ** (snr_db / 10)))
    return to_int16(sound)
