"""Whisper on this machine, through faster-whisper, from a model folder that the person has put there."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

from chauffeur.concept import DataError, MissingExtraError
from chauffeur.speech.audio import Samples, to_float
from chauffeur.speech.base import HOTWORDS, Expect, Transcript
from chauffeur.speech.errors import RecogniserError

_EXAMPLES: Final = (
    ("Command", "slow down to 60 miles per hour."),
    ("Command", "change to the left lane."),
    ("Command", "overtake the truck in front."),
    ("Evaluate", "that was too aggressive."),
)


def prompt_for(expect: Expect) -> str:
    """Text that Whisper takes for what was said before, so that it expects such words.

    With a button held no hotword is said, and none stands in it: it would be heard where nobody said it.
    """
    if expect in HOTWORDS:
        return " ".join(words.capitalize() for _, words in _EXAMPLES)
    return " ".join(f"{hotword}: {words}" for hotword, words in _EXAMPLES)


SURE: Final = 0.9
"""Confidence below which the person is asked. Whisper base is wrong above 0.6 in 24 of 92 driving sentences (synthetic
voices, benchmarks/RESULTS.md), above 0.9 in 4 of 37."""

_NEEDED: Final = ("model.bin", "config.json", "tokenizer.json")
"""Without the tokenizer the library would fetch one from the network; it never gets so far."""

_NO_SPEECH: Final = 0.6
_NO_SPEECH_CONFIDENCE: Final = 0.37
"""Whisper's own rule for silence: probability of no speech above 0.6 and mean log-probability below -1."""

_MOST_TOKENS: Final = 96


class WhisperRecogniser:
    """Hears free speech in English. Weights are never fetched: give a folder in CTranslate2's format."""

    def __init__(self, folder: Path, *, threads: int = 2) -> None:
        """Load a model.

        Args:
            folder: With model.bin, config.json, tokenizer.json and the vocabulary, as published for faster-whisper.
            threads: CPU threads.

        Raises:
            MissingExtraError: faster-whisper is not installed.
            DataError: No such folder, files are missing, or it is no Whisper model.
        """
        missing = [name for name in _NEEDED if not (folder / name).is_file()]
        if missing:
            raise DataError(
                f"{folder} is not a Whisper model: {', '.join(missing)} missing.",
                hint="Download one for faster-whisper (e.g. small.en, CTranslate2 format) and give its folder.",
            )
        try:
            from faster_whisper import WhisperModel  # pyright: ignore[reportMissingImports]
        except ImportError as error:
            raise MissingExtraError("Whisper needs faster-whisper.", extra="speech") from error
        try:
            self._model: Any = WhisperModel(
                str(folder), device="cpu", compute_type="int8", cpu_threads=threads, local_files_only=True
            )
        except (RuntimeError, ValueError, OSError, KeyError) as error:
            raise DataError(f"The Whisper model in {folder} cannot be loaded: {error}.") from error
        self._folder = folder
        self._lock = threading.Lock()

    @property
    def name(self) -> str:
        """`whisper/` and the folder's name."""
        return f"whisper/{self._folder.resolve().name}"

    @property
    def remote(self) -> bool:
        """The sound stays on this machine."""
        return False

    def recognise(self, samples: Samples, expect: Expect = "open") -> Transcript:
        """Words of one utterance.

        Args:
            samples: Mono at 16 kHz.
            expect: What may be said; the vocabulary is free all the same.

        Raises:
            RecogniserError: The model failed.
        """
        sound = to_float(samples)
        try:
            with self._lock:
                segments: Iterable[Any] = self._model.transcribe(
                    sound,
                    language="en",
                    beam_size=1,
                    temperature=0.0,  # no second tries: they take seconds
                    initial_prompt=prompt_for(expect),
                    condition_on_previous_text=False,
                    without_timestamps=True,
                    max_new_tokens=_MOST_TOKENS,
                )[0]
                found = [(str(s.text), float(s.avg_logprob), float(s.no_speech_prob)) for s in segments]
        except (RuntimeError, ValueError, IndexError) as error:
            raise RecogniserError(f"{self.name} failed: {error}.") from error
        finally:
            sound.fill(0.0)
        return transcript(found)


def transcript(segments: list[tuple[str, float, float]]) -> Transcript:
    """What Whisper's segments (text, mean log-probability, probability of no speech) come to."""
    kept = [
        (text.strip(), logprob)
        for text, logprob, no_speech in segments
        if text.strip() and not (no_speech > _NO_SPEECH and math.exp(logprob) < _NO_SPEECH_CONFIDENCE)
    ]
    if not kept:
        return Transcript("", 0.0, reason="There are no words in it.")
    # A wish is as sure as its least sure part.
    confidence = min(1.0, math.exp(min(logprob for _, logprob in kept)))
    return Transcript(" ".join(text for text, _ in kept), confidence, to_confirm=confidence < SURE)
