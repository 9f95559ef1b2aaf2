"""From sound to words: what a recogniser is asked, what it answers, and what becomes of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, Protocol

from chauffeur.speech.audio import Samples

Hotword = Literal["command", "evaluate"]
"""First word of what is said to the car: a wish, or an opinion on the last drive. Each is also a button."""

HOTWORDS: Final[tuple[Hotword, ...]] = ("command", "evaluate")
"""Every hotword."""

Expect = Literal["open", "command", "evaluate", "answer"]
"""`open`: the microphone hears everything, so a hotword has to come first. `answer`: the same, but yes or no may be
said as well, without one. Otherwise the button that was held."""

Status = Literal["heard", "no_hotword", "not_understood", "nothing", "failed"]
"""`heard`: there is a wish. `nothing`: no speech. `failed`: the engine did not answer. The others say themselves."""


@dataclass(frozen=True, slots=True)
class Transcript:
    """What a recogniser made of a stretch of speech.

    Attributes:
        text: Words, in lower case where the engine knows no other; empty when it understood none.
        confidence: How sure it is, 0 to 1; None where the engine does not say.
        to_confirm: Whether the person has to be asked before it is driven.
        reason: Why there is no text, in words; empty where there is.
    """

    text: str
    confidence: float | None = None
    to_confirm: bool = False
    reason: str = ""


class Recogniser(Protocol):
    """An engine that turns speech into words."""

    @property
    def name(self) -> str:
        """Kind and version or model, e.g. `grammar/pocketsphinx-5.1.1`."""
        ...

    @property
    def remote(self) -> bool:
        """Whether the sound leaves this machine."""
        ...

    def recognise(self, samples: Samples, expect: Expect = "open") -> Transcript:
        """Words of one utterance. Keeps nothing of the sound.

        Args:
            samples: Mono at 16 kHz.
            expect: What may be said; engines with a free vocabulary need not care.

        Raises:
            RecogniserError: The engine gave no answer.
        """
        ...


class FollowingRecogniser(Recogniser, Protocol):
    """An engine that goes along with an utterance while it is spoken, and so knows sooner what was said.

    What it guesses on the way is not believed before it has been checked against the whole sound. For one stream.
    """

    def begin(self, expect: Expect) -> None:
        """An utterance begins; the one before is forgotten."""
        ...

    def follow(self, samples: Samples) -> None:
        """The next samples of it. Keeps nothing of the sound."""
        ...

    def guess(self) -> str:
        """Words that were said so far, if they make a whole sentence; else empty."""
        ...

    def check(self, samples: Samples, expect: Expect, text: str) -> Transcript:
        """Whether the whole utterance so far says exactly that: quicker than `recognise`, which asks what it says."""
        ...


@dataclass(frozen=True, slots=True)
class Timing:
    """Where the time went, in s.

    Attributes:
        speech_s: From the first to the last voiced frame.
        wait_s: Silence that was waited for after the last of them, to be sure that it was the last.
        detect_s: Work of voice activity detection over the whole utterance. It runs while the person speaks.
        recognise_s: Work of the engine, as far as it was not done during the wait.
    """

    speech_s: float = 0.0
    wait_s: float = 0.0
    detect_s: float = 0.0
    recognise_s: float = 0.0

    @property
    def after_speech_s(self) -> float:
        """From the end of speech to the text."""
        return self.wait_s + self.recognise_s


@dataclass(frozen=True, slots=True)
class Heard:
    """What was heard, when the sound itself is gone.

    Attributes:
        status: What became of it.
        text: The words without their hotword. Empty unless `heard`: what is not said to the car is not kept.
        hotword: `command` or `evaluate`; None where neither was said and no button was held, as in a yes or no.
        button: Whether a button was held instead.
        engine: Name of the recogniser.
        confidence: How sure it is, 0 to 1; None where the engine does not say.
        to_confirm: Whether the person has to be asked before it is driven.
        reason: In words, unless `heard`.
        notes: What was wrong with the sound, in words.
        timing: Where the time went.
        end_sample: Where in the stream its last voiced frame ended, in samples since the listener began.
        again: The person went on after a part of this was given: it takes the place of that part.
    """

    status: Status
    text: str
    hotword: Hotword | None
    engine: str
    button: bool = False
    confidence: float | None = None
    to_confirm: bool = False
    reason: str = ""
    notes: tuple[str, ...] = ()
    timing: Timing = Timing()
    end_sample: int = 0
    again: bool = False
