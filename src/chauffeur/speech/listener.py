"""From a stream of sound to what was heard: segments, hotword or button, engine, and then the sound is erased."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

from chauffeur.concept import ConfigError
from chauffeur.speech.audio import SAMPLE_RATE_HZ, Recording, Samples, level_notes
from chauffeur.speech.base import Expect, Heard, Hotword, Recogniser, Timing
from chauffeur.speech.detector import SileroDetector, VoiceDetector
from chauffeur.speech.errors import RecogniserError
from chauffeur.speech.hotwords import split_hotword
from chauffeur.speech.segments import LONGEST_S, Segmenter, Utterance

_CHUNK: Final = SAMPLE_RATE_HZ // 10
_HINTS: Final = {
    "no_hotword": "It does not begin with “command” or “evaluate”, so it was not meant for the car.",
    "nothing": "Nothing was said.",
}


class Listener:
    """Hears one stream. With the microphone open, a hotword has to come first; with a button held, none is needed.

    Feeding is quick except when an utterance ends: then it takes as long as the engine does. Not for several threads.
    """

    def __init__(
        self,
        recogniser: Recogniser,
        detector: VoiceDetector | None = None,
        *,
        open_microphone: bool | None = None,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        """Begin to listen.

        Args:
            recogniser: Engine; may serve several listeners, one utterance at a time.
            detector: Voice activity; Silero's if left out. It is this listener's own from now on.
            open_microphone: Whether to listen while no button is held. If left out: only where the sound stays on this
                machine, since everything said in the cabin would go to a remote engine.
            clock: Measures durations, in s.

        Raises:
            MissingExtraError: No detector was given, and the library for one is missing.
        """
        self._recogniser = recogniser
        self._open = not recogniser.remote if open_microphone is None else open_microphone
        self._clock = clock
        self._segments = Segmenter(SileroDetector() if detector is None else detector, clock=clock)
        self._button: Hotword | None = None
        self._held: list[Utterance] = []

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
            return []
        found = self._segments.push(chunk)
        if self._button is None:
            return [self._hear(utterance) for utterance in found]
        for utterance in found:
            self._hold(utterance)
        return []

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
        return [self._hear(utterance) for utterance in self._segments.flush()]

    def stop(self) -> None:
        """Drop everything that is held, e.g. when the microphone is muted."""
        self._drop()
        self._button = None

    def _drop(self) -> None:
        self._segments.reset()
        for utterance in self._held:
            utterance.erase()
        self._held = []

    def _hold(self, utterance: Utterance) -> None:
        """Keep a part of what is said with a button held, as long as all of it is not too long."""
        if sum(len(one.samples) for one in self._held) > LONGEST_S * SAMPLE_RATE_HZ:
            self._held[-1].cut = True
            utterance.erase()
        else:
            self._held.append(utterance)

    def _hear(self, utterance: Utterance, button: Hotword | None = None) -> Heard:
        try:
            return self._judge(utterance, button)
        finally:
            utterance.erase()

    def _judge(self, utterance: Utterance, button: Hotword | None) -> Heard:
        timing = Timing(utterance.speech_s, utterance.wait_s, utterance.detect_s)
        heard = Heard(
            "not_understood",
            "",
            button,
            self._recogniser.name,
            button=button is not None,
            notes=level_notes(utterance.samples),
            timing=timing,
        )
        if utterance.cut:
            return replace(heard, reason=f"It goes on for more than {LONGEST_S:g} s; half of it is not driven.")
        expect: Expect = "open" if button is None else button
        started = self._clock()
        try:
            transcript = self._recogniser.recognise(utterance.samples, expect)
        except RecogniserError as error:
            timing = replace(timing, recognise_s=self._clock() - started)
            return replace(heard, status="failed", reason=str(error), timing=timing)
        timing = replace(timing, recognise_s=self._clock() - started)
        heard = replace(heard, timing=timing, confidence=transcript.confidence, to_confirm=transcript.to_confirm)
        if not transcript.text:
            return replace(heard, reason=transcript.reason)
        hotword, words = split_hotword(transcript.text)
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


def _joined(held: list[Utterance]) -> Utterance:
    """The parts of what was said with a button held, as one; the parts are erased."""
    whole = Utterance(
        np.concatenate([part.samples for part in held]),
        speech_s=sum(part.speech_s for part in held),
        detect_s=sum(part.detect_s for part in held),
        cut=any(part.cut for part in held),
    )
    for part in held:
        part.erase()
    return whole
