"""Shared fixtures. Third-party data is read where it lies; tests that need it skip, and say why, where it is absent."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

SHARED_DATA = Path(os.environ.get("CHAUFFEUR_TEST_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))


@pytest.fixture(scope="session")
def lampilot_data() -> Path:
    """Folder with `DbLv1-dev` and the peer's own outcomes."""
    folder = SHARED_DATA / "lampilot"
    if not (folder / "DbLv1-dev").is_dir():
        pytest.skip(f"LaMPilot data not found at {folder}; set CHAUFFEUR_TEST_DATA to the folder that holds lampilot/")
    return folder


@pytest.fixture(autouse=True)
def _private_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No test touches the user's profiles or cache."""
    monkeypatch.setenv("CHAUFFEUR_HOME", str(tmp_path / "home"))


@pytest.fixture(scope="session")
def speech() -> Callable[[str], bytes]:
    """A sentence in a synthetic voice, half a second of quiet before it and a second behind, as 16 kHz PCM."""
    if shutil.which("espeak-ng") is None:
        pytest.skip("espeak-ng is not installed")
    pytest.importorskip("soxr", reason="needs the extra `speech`")
    from chauffeur.speech.audio import SAMPLE_RATE_HZ, decode

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
