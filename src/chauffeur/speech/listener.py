"""From a stream of sound to what was heard: segments, hotword or button, engine, and then the sound is erased."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from chauffeur.concept import ConfigError
from chauffeur.language.meaning.turns import answer_in
from chauffeur.speech.audio import SAMPLE_RATE_HZ, Recording, Samples, level_notes
from chauffeur.speech.base import HOTWORDS, Expect, FollowingRecogniser, Heard, Hotword, Recogniser, Timing, Transcript
from chauffeur.speech.detector import FRAME, SileroDetector, VoiceDetector
from chauffeur.speech.errors import RecogniserError
from chauffeur.speech.segments import FRAME_S, LONGEST_S, Segmenter, SpeechSegment

_FIRST: Final = re.compile(rf"\A\W*({'|'.join(HOTWORDS)})\b[\s,.:;!?…-]*", re.IGNORECASE)


def split_hotword(text: str) -> tuple[Hotword | None, str]:
    """(hotword, the words behind it); (None, the text) where the first word is none."""
    found = _FIRST.match(text)
    if found is None:
        return None, text.strip()
    word: Hotword = "command" if found.group(1).lower() == "command" else "evaluate"
    return word, text[found.end() :].strip()


AHEAD_FRAMES: Final = 1
"""Frames without voice (0.03 s) after which an engine that hears ahead checks what it guesses was said so far."""
AGAIN_FRAMES: Final = 7
"""Frames without voice (0.22 s) after which it is checked once more, where the first check was too early for it."""
HARMLESS_FRAMES: Final = 4
"""Frames without voice (0.13 s) after which a wish that needs no asking back is given, heard ahead."""
WHOLE_FRAMES: Final = 14
"""Frames without voice (0.45 s) after which any wish or answer that was heard ahead is given."""
AHEAD_LONGEST_S: Final = 6.0
"""Longest speech that is heard ahead: whoever talks longer talks to somebody else, and each pause costs time."""

_Engine = Callable[[Samples, Expect], Transcript]

_CHUNK: Final = SAMPLE_RATE_HZ // 10
_HINTS: Final = {
    "no_hotword": "It does not begin with “command” or “evaluate”, so it was not meant for the car.",
    "nothing": "Nothing was said.",
}


@dataclass(frozen=True, slots=True)
class _Ahead:
    """What was heard before it was certain that the person had finished.

    Attributes:
        heard: It.
        end_sample: Where its last voiced frame ended: speech that goes on makes it worthless.
        given: Whether it was given already.
    """

    heard: Heard
    end_sample: int
    given: bool = False


class Listener:
    """Hears one stream. With the microphone open, a hotword has to come first; with a button held, none is needed.

    An engine may hear ahead: it goes along while the person speaks, in each short pause it checks what it guesses was
    said so far, and where that is a whole wish, it is given before the long silence that ends an utterance. No word is
    cut off by that: when the person goes on, the whole utterance is heard once more in the end and given in the place
    of its part (`Heard.again`).

    Feeding is quick except when the engine hears: then it takes as long as that does. Not for several threads.
    """

    def __init__(
        self,
        recogniser: Recogniser,
        detector: VoiceDetector | None = None,
        *,
        open_microphone: bool | None = None,
        ahead: FollowingRecogniser | None = None,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        """Begin to listen.

        Args:
            recogniser: Engine; may serve several listeners, one utterance at a time.
            detector: Voice activity; Silero's if left out. It is this listener's own from now on.
            open_microphone: Whether to listen while no button is held. If left out: only where the sound stays on this
                machine, since everything said in the cabin would go to a remote engine.
            ahead: Engine that hears ahead, None for none; this listener's own.
            clock: Measures durations, in s.

        Raises:
            MissingExtraError: No detector was given, and the library for one is missing.
        """
        self._recogniser = recogniser
        self._open = not recogniser.remote if open_microphone is None else open_microphone
        self._clock = clock
        self._segments = Segmenter(SileroDetector() if detector is None else detector, clock=clock)
        self._button: Hotword | None = None
        self._held: list[SpeechSegment] = []
        self._follower = ahead
        self._followed = 0
        self._ahead: _Ahead | None = None
        self._part_given = False
        self.answer_expected = False
        """Whether yes or no may be said as well, without a hotword."""

    @property
    def speaking(self) -> bool:
        """Whether somebody is speaking just now."""
        return self._segments.speaking

    @property
    def held_bytes(self) -> int:
        """Bytes of sound that are held now."""
        return self._segments.held_bytes + sum(utterance.samples.nbytes for utterance in self._held)

    def feed(self, chunk: bytes | bytearray | memoryview | Samples) -> list[Heard]:
        """Take sound (16 kHz, 16 bit, little-endian, mono) of any length, and give what was heard by its end."""
        if self._button is None and not self._open:
            self._segments.skip(chunk.nbytes if isinstance(chunk, np.ndarray) else len(chunk))
            return []
        found: list[Heard] = []
        for utterance in self._segments.steps(chunk):
            if self._button is None:
                found += self._pause() if utterance is None else self._ended(utterance)
            elif utterance is not None:
                self._hold(utterance)
        return found

    def press(self, button: Hotword) -> None:
        """A button is held from now on; what was being said before is dropped."""
        self._drop()
        self._button = button

    def release(self) -> Heard:
        """The button is let go: what was said meanwhile, as one utterance.

        Raises:
            ConfigError: No button was held.
        """
        button = self._button
        if button is None:
            raise ConfigError("No button was held.")
        for utterance in self._segments.flush():
            self._hold(utterance)
        held, self._held, self._button = self._held, [], None
        if not held:
            return Heard("nothing", "", button, self._recogniser.name, button=True, reason=_HINTS["nothing"])
        return self._hear(_joined(held), button)

    def finish(self) -> list[Heard]:
        """The stream ends: what was heard of its end. A button that is still held counts as let go."""
        if self._button is not None:
            return [self.release()]
        return [heard for utterance in self._segments.flush() for heard in self._ended(utterance)]

    def stop(self) -> None:
        """Drop everything that is held, e.g. when the microphone is muted."""
        self._drop()
        self._button = None

    def _pause(self) -> list[Heard]:
        """After a frame that ends nothing: check in a pause what was said so far, give it when the pause has lasted."""
        follower = self._follower
        if follower is None or not self._follow(follower):
            return []
        quiet, end_sample = self._segments.quiet_frames, self._segments.end_sample
        if quiet < AHEAD_FRAMES:
            return []
        ahead = self._ahead
        if ahead is not None and ahead.heard.status != "heard" and quiet == AGAIN_FRAMES:
            ahead = None
        if ahead is None or ahead.end_sample != end_sample:
            text = follower.guess()
            so_far = self._segments.so_far() if text else None
            if so_far is None:
                return []
            heard = self._hear(so_far, ahead=lambda samples, expect: follower.check(samples, expect, text))
            ahead = self._ahead = _Ahead(heard, end_sample)
        if ahead.given or quiet < _given_after(ahead.heard):
            return []
        wait_s = quiet * FRAME_S
        heard = replace(ahead.heard, again=self._part_given)
        # What the engine did while the silence went on anyway cost nobody any time.
        over_s = max(0.0, heard.timing.wait_s + heard.timing.recognise_s - wait_s)
        heard = replace(heard, timing=replace(heard.timing, wait_s=wait_s, recognise_s=over_s))
        self._ahead, self._part_given = replace(ahead, given=True), True
        return [heard]

    def _follow(self, follower: FollowingRecogniser) -> bool:
        """Have the engine go along; False where there is nothing to go along with."""
        if not self._segments.speaking or self._followed * FRAME > AHEAD_LONGEST_S * SAMPLE_RATE_HZ:
            self._followed = self._followed if self._segments.speaking else 0
            return False
        if self._followed == 0:
            follower.begin("answer" if self.answer_expected else "open")
        news = self._segments.frames_from(self._followed)
        self._followed += len(news) // FRAME
        follower.follow(news)
        return True

    def _ended(self, utterance: SpeechSegment) -> list[Heard]:
        """An utterance ended: nothing more of it if it was given already, and all of it once more if it went on."""
        self._followed = 0
        ahead, self._ahead = self._ahead, None
        part_given, self._part_given = self._part_given, False
        if ahead is not None and ahead.given and ahead.end_sample == utterance.end_sample:
            utterance.erase()
            return []
        return [replace(self._hear(utterance), again=part_given)]

    def _drop(self) -> None:
        self._ahead, self._part_given, self._followed = None, False, 0
        self._segments.reset()
        for utterance in self._held:
            utterance.erase()
        self._held = []

    def _hold(self, utterance: SpeechSegment) -> None:
        """Keep a part of what is said with a button held, as long as all of it is not too long."""
        if sum(len(one.samples) for one in self._held) > LONGEST_S * SAMPLE_RATE_HZ:
            self._held[-1].cut = True
            utterance.erase()
        else:
            self._held.append(utterance)

    def _hear(self, utterance: SpeechSegment, button: Hotword | None = None, ahead: _Engine | None = None) -> Heard:
        try:
            return self._judge(utterance, button, ahead or self._recogniser.recognise)
        finally:
            utterance.erase()

    def _judge(self, utterance: SpeechSegment, button: Hotword | None, recognise: _Engine) -> Heard:
        timing = Timing(utterance.speech_s, utterance.wait_s, utterance.detect_s)
        heard = Heard(
            "not_understood",
            "",
            button,
            self._recogniser.name,
            button=button is not None,
            notes=level_notes(utterance.samples),
            timing=timing,
            end_sample=utterance.end_sample,
        )
        if utterance.cut:
            return replace(heard, reason=f"It goes on for more than {LONGEST_S:g} s; half of it is not driven.")
        expect: Expect = button or ("answer" if self.answer_expected else "open")
        started = self._clock()
        try:
            transcript = recognise(utterance.samples, expect)
        except RecogniserError as error:
            timing = replace(timing, recognise_s=self._clock() - started)
            return replace(heard, status="failed", reason=str(error), timing=timing)
        timing = replace(timing, recognise_s=self._clock() - started)
        heard = replace(heard, timing=timing, confidence=transcript.confidence, to_confirm=transcript.to_confirm)
        if not transcript.text:
            return replace(heard, reason=transcript.reason)
        hotword, words = split_hotword(transcript.text)
        if button is None and hotword is None and self.answer_expected and answer_in(words) is not None:
            return replace(heard, status="heard", text=words)
        if button is None and hotword is None:
            return replace(heard, status="no_hotword", reason=_HINTS["no_hotword"])
        if not words:
            return replace(heard, hotword=button or hotword, reason="There is nothing behind the hotword.")
        # The button says what is meant; a hotword said as well is only taken off.
        return replace(heard, status="heard", text=words, hotword=button or hotword)


def hear_recording(
    recording: Recording,
    recogniser: Recogniser,
    detector: VoiceDetector | None = None,
    *,
    button: Hotword | None = None,
    clock: Callable[[], float] = time.perf_counter,
) -> list[Heard]:
    """What is heard in a recording; its samples are erased.

    Args:
        recording: Any length; what was heard comes in order.
        recogniser: Engine. Giving a recording to a remote one is the caller's choice.
        detector: Voice activity; Silero's if left out.
        button: As if this button had been held all the time.
        clock: Measures durations.

    Raises:
        MissingExtraError: No detector was given, and the library for one is missing.
    """
    listener = Listener(recogniser, detector, open_microphone=True, clock=clock)
    found: list[Heard] = []
    try:
        if button is not None:
            listener.press(button)
        for start in range(0, len(recording.samples), _CHUNK):
            found += listener.feed(recording.samples[start : start + _CHUNK])
        found += listener.finish()
    finally:
        listener.stop()
        if recording.samples.flags.writeable:
            recording.samples.fill(0)
    return [replace(heard, notes=tuple(dict.fromkeys((*recording.notes, *heard.notes)))) for heard in found]


def _given_after(heard: Heard) -> float:
    """Frames of silence after which something heard ahead is given; never, where the end has to be waited for.

    An opinion is waited for: it is kept, and half of one must not be. So is what is no whole sentence.
    """
    if heard.status != "heard" or heard.hotword == "evaluate":
        return math.inf
    return WHOLE_FRAMES if heard.to_confirm or heard.hotword is None else HARMLESS_FRAMES


def _joined(held: list[SpeechSegment]) -> SpeechSegment:
    """The parts of what was said with a button held, as one; the parts are erased."""
    whole = SpeechSegment(
        np.concatenate([part.samples for part in held]),
        speech_s=sum(part.speech_s for part in held),
        detect_s=sum(part.detect_s for part in held),
        end_sample=held[-1].end_sample,
        cut=any(part.cut for part in held),
    )
    for part in held:
        part.erase()
    return whole
