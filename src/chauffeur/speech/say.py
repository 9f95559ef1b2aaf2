"""Spoken replies, through espeak-ng where it is installed; silence where it is not.

What is said is data: it reaches the program through a pipe, and never a shell.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from typing import Final

from chauffeur.language.letters import clean

MOST_CHARS: Final = 300
"""Longer replies are broken off at a sentence: nobody listens to more than 20 s of a car."""

_PROGRAM: Final = "espeak-ng"
_WORDS_A_MINUTE: Final = 165
_VOICE: Final = "en-us"
_SPEAK_S: Final = 60.0
_RENDER_S: Final = 10.0

_MARKUP: Final = re.compile(r"[\[\]<>{}|\\^~`*_#]+")
"""espeak-ng reads `[[...]]` as phonemes, and other signs aloud by name."""


def can_speak() -> bool:
    """Whether espeak-ng is installed."""
    return shutil.which(_PROGRAM) is not None


def speakable(text: str) -> str:
    """What of a text is said: plain, one line, and not too long."""
    words = " ".join(_MARKUP.sub(" ", clean(text)).split())
    if len(words) <= MOST_CHARS:
        return words
    kept = words[:MOST_CHARS]
    end = max(kept.rfind(mark) for mark in ".!?")
    return kept[: end + 1] if end > 0 else kept.rsplit(" ", 1)[0]


def say(text: str) -> bool:
    """Say something through the loudspeaker, and wait until it is said. Returns whether it was."""
    return _run(text, (), _SPEAK_S) is not None


def render(text: str) -> bytes | None:
    """The same as a WAV file in memory, e.g. for a page to play; None where nothing can be said."""
    return _run(text, ("--stdout",), _RENDER_S) or None


def _run(text: str, extra: tuple[str, ...], timeout_s: float) -> bytes | None:
    """Output of espeak-ng; None if it is missing, fails, hangs, or there is nothing to say."""
    program, words = shutil.which(_PROGRAM), speakable(text)
    if program is None or not words:
        return None
    command = [program, "--stdin", "-v", _VOICE, "-s", str(_WORDS_A_MINUTE), *extra]
    try:
        done = subprocess.run(  # noqa: S603 - a list; the words come through a pipe
            command, input=words.encode(), capture_output=True, timeout=timeout_s, check=False
        )
    except (subprocess.TimeoutExpired, OSError):
        return None
    return done.stdout if done.returncode == 0 else None
