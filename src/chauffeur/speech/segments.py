"""Utterances out of a stream: chunks of any size go in, stretches of speech come out; memory is bounded."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Final

import numpy as np

from chauffeur.speech.audio import SAMPLE_RATE_HZ, Samples
from chauffeur.speech.detector import FRAME, VoiceDetector

FRAME_S: Final = FRAME / SAMPLE_RATE_HZ
"""Duration of a frame."""

LONGEST_S: Final = 15.0
"""Longest utterance. Wishes take 2 to 5 s; whoever talks longer does not talk to the car."""

_LEAD_FRAMES: Final = 10
"""Frames kept before speech is noticed (0.3 s): soft first consonants come before it."""

_TAIL_FRAMES: Final = 10
"""Frames kept after the last voiced one."""

_ONSET_FRAMES: Final = 3
"""Voiced frames in a row that begin an utterance: a click is shorter."""

_WAIT_FRAMES: Final = 22
"""Frames without voice that end it (0.7 s): people pause after "command"."""

_FEWEST_VOICED: Final = 5
"""Voiced frames of the shortest utterance (0.16 s); "stop" has 8 or more."""

_BEGIN: Final = 0.5
_END: Final = 0.35
"""Probabilities of speech from which a frame begins an utterance, and below which one does not go on with it."""


class SpeechSegment:
    """A stretch of speech. Whoever takes it erases it when it has been heard.

    Attributes:
        samples: Mono at 16 kHz, with a little of what came before and after.
        speech_s: From the first to the last voiced frame.
        wait_s: Silence that was waited for after the last voiced frame.
        detect_s: Time that voice activity detection took for it.
        end_sample: Where in the stream its last voiced frame ended, in samples.
        cut: Whether it was longer than allowed, so that its end is missing.
    """

    __slots__ = ("cut", "detect_s", "end_sample", "samples", "speech_s", "wait_s")

    def __init__(
        self,
        samples: Samples,
        *,
        speech_s: float,
        wait_s: float = 0.0,
        detect_s: float = 0.0,
        end_sample: int = 0,
        cut: bool = False,
    ) -> None:
        """Take the samples over; they are overwritten by `erase`."""
        self.samples = samples
        self.speech_s = speech_s
        self.wait_s = wait_s
        self.detect_s = detect_s
        self.end_sample = end_sample
        self.cut = cut

    def erase(self) -> None:
        """Overwrite the sound with zeros and let go of it."""
        self.samples.fill(0)
        self.samples = self.samples[:0].copy()


class Segmenter:
    """Cuts a stream into utterances. What it gives does not depend on how the stream is cut into chunks."""

    def __init__(
        self,
        detector: VoiceDetector,
        *,
        longest_s: float = LONGEST_S,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        """Begin to listen.

        Args:
            detector: Says whether a frame holds speech; it is this segmenter's own from now on.
            longest_s: Longest utterance. One that goes on is given out as far as it was kept, marked as cut; the rest
                of it is dropped.
            clock: Measures the detector's work.
        """
        self._detector = detector
        self._clock = clock
        self._most = max(_LEAD_FRAMES + _ONSET_FRAMES, int(longest_s / FRAME_S))
        # All the sound there ever is: one buffer, and less than a frame that waits for its rest.
        self._kept: Samples = np.zeros(self._most * FRAME, np.int16)
        self._rest = bytearray()
        self._frames = 0
        self._passed = 0
        self._begin()

    @property
    def held_bytes(self) -> int:
        """Bytes of sound that are held at most and at any time."""
        return self._kept.nbytes + len(self._rest)

    @property
    def speaking(self) -> bool:
        """Whether an utterance is going on."""
        return self._speaking

    @property
    def quiet_frames(self) -> int:
        """Frames without voice since the last voiced one of the utterance that is going on; 0 while there is none."""
        return self._quiet if self._speaking else 0

    @property
    def end_sample(self) -> int:
        """Where in the stream the last voiced frame of the utterance that is going on ended."""
        return self._passed - self._quiet * FRAME

    def frames_from(self, first: int) -> Samples:
        """Samples of the utterance that is going on, from a frame of it to now; a view that is good until the next one.

        Empty while there is none.
        """
        return self._kept[first * FRAME : self._frames * FRAME] if self._speaking else self._kept[:0]

    def so_far(self) -> SpeechSegment | None:
        """A copy of the utterance that is going on, which goes on; None if there is too little voice in it yet."""
        return self._take(waited=self._quiet) if self._speaking else None

    def push(self, chunk: bytes | bytearray | memoryview | Samples) -> list[SpeechSegment]:
        """Take sound, and give the utterances that ended in it.

        Args:
            chunk: Samples, or their bytes (16 bit, little-endian), of any length; half a sample waits for its rest.
        """
        return [utterance for utterance in self.steps(chunk) if utterance is not None]

    def steps(self, chunk: bytes | bytearray | memoryview | Samples) -> Iterator[SpeechSegment | None]:
        """The same frame by frame: for each frame the utterance that ended with it, or None."""
        view = memoryview(_bytes(chunk))
        size = 2 * FRAME
        start = 0
        while len(view) - start + len(self._rest) >= size:
            need = size - len(self._rest)
            frame = bytes(self._rest) + bytes(view[start : start + need])
            start += need
            self._rest.clear()
            self._passed += FRAME
            yield self._frame(np.frombuffer(frame, "<i2").astype(np.int16))
        self._rest += view[start:]

    def skip(self, length: int) -> None:
        """So many bytes of the stream are not heard."""
        self._passed += length // 2

    def flush(self) -> list[SpeechSegment]:
        """The stream ends: give the utterance that was going on, if it is one."""
        utterance = self._take(waited=self._quiet) if self._speaking else None
        self.reset()
        return [] if utterance is None else [utterance]

    def reset(self) -> None:
        """Overwrite what is held and begin anew."""
        self._detector.reset()
        self._kept.fill(0)
        self.skip(len(self._rest))
        self._rest[:] = bytes(len(self._rest))
        self._rest.clear()
        self._begin()

    def _begin(self) -> None:
        self._kept[: self._frames * FRAME].fill(0)
        self._frames = 0
        self._speaking = False
        self._dropping = False
        self._onset = 0
        self._voiced = 0
        self._first = 0
        self._last = 0
        self._quiet = 0
        self._detect_s = 0.0

    def _frame(self, frame: Samples) -> SpeechSegment | None:
        started = self._clock()
        probability = self._detector.probability(frame)
        spent_s = self._clock() - started
        if self._dropping:
            self._quiet = 0 if probability >= _END else self._quiet + 1
            if self._quiet >= _WAIT_FRAMES:
                self._begin()
            return None
        if not self._speaking:
            self._await(frame, probability, spent_s)
            return None
        self._keep(frame)
        self._detect_s += spent_s
        if probability >= _END:
            self._voiced += 1
            self._last = self._frames
            self._quiet = 0
        else:
            self._quiet += 1
        if self._quiet >= _WAIT_FRAMES:
            utterance = self._take(waited=self._quiet)
            self._begin()
            return utterance
        if self._frames == self._most:
            utterance = self._take(waited=0, cut=True)
            self._begin()
            self._dropping = True
            return utterance
        return None

    def _await(self, frame: Samples, probability: float, spent_s: float) -> None:
        """Keep the last few frames until enough in a row are voiced."""
        most = _LEAD_FRAMES + _ONSET_FRAMES
        if self._frames == most:
            self._kept[: (most - 1) * FRAME] = self._kept[FRAME : most * FRAME].copy()
            self._frames -= 1
        self._keep(frame)
        self._onset = self._onset + 1 if probability >= _BEGIN else 0
        self._detect_s = self._detect_s + spent_s if self._onset else 0.0
        if self._onset == _ONSET_FRAMES:
            self._speaking = True
            self._voiced = _ONSET_FRAMES
            self._first = self._frames - _ONSET_FRAMES
            self._last = self._frames

    def _keep(self, frame: Samples) -> None:
        self._kept[self._frames * FRAME : (self._frames + 1) * FRAME] = frame
        self._frames += 1

    def _take(self, *, waited: int, cut: bool = False) -> SpeechSegment | None:
        """What is kept as an utterance of its own; None if there is too little voice in it."""
        if self._voiced < _FEWEST_VOICED:
            return None
        end = min(self._frames, self._last + _TAIL_FRAMES)
        return SpeechSegment(
            self._kept[: end * FRAME].copy(),
            speech_s=(self._last - self._first) * FRAME_S,
            wait_s=waited * FRAME_S,
            detect_s=self._detect_s,
            end_sample=self._passed - self._quiet * FRAME,
            cut=cut,
        )


def _bytes(chunk: bytes | bytearray | memoryview | Samples) -> bytes | bytearray | memoryview:
    return chunk.astype("<i2", copy=False).tobytes() if isinstance(chunk, np.ndarray) else chunk
