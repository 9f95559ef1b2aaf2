"""The microphone through PortAudio and ALSA themselves: ALSA plays a file as if it came from a microphone."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ALSA = Path("/usr/share/alsa/alsa.conf")

CONFIG = """
<{base}>
pcm.spoken {{
  type file slave {{ pcm "null" }} file "/dev/null" infile "{sound}" format "raw"
  hint {{ show on description "a file as a microphone" }}
}}
pcm.!default {{
  type plug slave {{ pcm "spoken" rate {rate} format S16_LE channels 1 }}
  hint {{ show on description "default" }}
}}
"""

LISTEN = """
import sys
import chauffeur.speech.microphone as module
import numpy as np
from chauffeur.concept import ChauffeurError
from chauffeur.speech import Microphone
try:
    with Microphone(sys.argv[1] if sys.argv[1:] not in ([], ["unplug"]) else None) as microphone:
        found = []
        for chunk in microphone:
            assert chunk.dtype == np.int16 and chunk.ndim == 1
            found.append(chunk)
            if len(found) == 20 and sys.argv[1:] == ["unplug"]:
                module.SILENT_S = 0.3
                microphone._stream.abort()  # what the driver does when the device goes
            elif len(found) == 20:
                break
        sound = np.concatenate(found)
        print(len(sound), int(np.abs(sound).max()), int(np.abs(sound[1600:8000] - sound[1600]).max()))
except ChauffeurError as error:
    print(type(error).__name__, error)
"""


def listen(environ: dict[str, str], *arguments: str) -> str:
    command = [sys.executable, "-c", LISTEN, *arguments]
    done = subprocess.run(
        command, env={**os.environ, **environ}, capture_output=True, text=True, timeout=600, check=True
    )
    return done.stdout.strip()


@pytest.fixture
def sounddevice() -> None:
    try:
        import sounddevice  # noqa: F401
    except (ImportError, OSError):
        pytest.skip("sounddevice or PortAudio is not installed")
    if not ALSA.is_file():
        pytest.skip("needs ALSA")


def test_sound_comes_in_chunks(sounddevice: None, tmp_path: Path) -> None:
    sound = (8000 * np.sin(np.arange(160_000) / 9)).astype("<i2")
    (tmp_path / "sound.raw").write_bytes(sound.tobytes())
    config = tmp_path / "asound.conf"
    config.write_text(CONFIG.format(base=ALSA, sound=tmp_path / "sound.raw", rate=16000))
    length, peak, spread = map(int, listen({"ALSA_CONFIG_PATH": str(config)}).split())
    assert length == 8 * 1600
    assert 7500 < peak < 8500 and spread > 7500


def test_a_microphone_that_goes_is_said_to_be_gone(sounddevice: None, tmp_path: Path) -> None:
    (tmp_path / "sound.raw").write_bytes(bytes(64_000))
    config = tmp_path / "asound.conf"
    config.write_text(CONFIG.format(base=ALSA, sound=tmp_path / "sound.raw", rate=16000))
    said = listen({"ALSA_CONFIG_PATH": str(config)}, "unplug")
    assert said.startswith("MicrophoneError The microphone ended: it may have been unplugged."), said


def test_no_microphone_and_an_unknown_one_are_said(sounddevice: None) -> None:
    import sounddevice as library

    asked = [("no such device",)] + ([] if len(library.query_devices()) else [()])
    for arguments in asked:
        said = listen({}, *arguments)
        assert said.startswith("MicrophoneError The microphone") and "cannot be opened" in said
        assert said.endswith("See what there is: python -m sounddevice")
