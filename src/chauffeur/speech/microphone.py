"""A microphone of this machine, through PortAudio."""

from __future__ import annotations

import queue
from collections.abc import Iterator
from contextlib import suppress
from types import TracebackType
from typing import Any, Final, Self

import numpy as np

from chauffeur.concept import MissingExtraError
from chauffeur.speech.audio import SAMPLE_RATE_HZ, Samples, to_int16
from chauffeur.speech.errors import MicrophoneError

SILENT_S: Final = 3.0
"""A microphone that gives nothing for this long is taken to be gone: some drivers never say so."""

_CHUNK_S: Final = 0.04
"""Short: what is said is heard half of this later on average."""

_WAITING: Final = 125
"""Chunks that may wait (5 s); when nobody takes them, the newest are dropped."""


class Microphone:
    """Chunks of sound at 16 kHz, until it is closed or stops. Use it in a `with` block."""

    def __init__(self, device: int | str | None = None) -> None:
        """Open a microphone.

        Args:
            device: Number or part of the name; the system's choice if left out.

        Raises:
            MissingExtraError: sounddevice or PortAudio is not installed.
            MicrophoneError: There is no such microphone, or it cannot be opened.
        """
        try:
            import sounddevice
        except ImportError as error:
            raise MissingExtraError("A microphone needs sounddevice.", extra="speech") from error
        except OSError as error:  # the Python part is there, the C library is not
            raise MissingExtraError(
                "A microphone needs the PortAudio library.", hint="Run: apt install libportaudio2"
            ) from error
        self._library: Any = sounddevice
        self._chunks: queue.Queue[Samples] = queue.Queue(_WAITING)
        self._ended = False
        self._resampler: Any = None
        try:
            self._stream: Any = self._open(device)
            self._stream.start()
        except (self._library.PortAudioError, ValueError) as error:
            raise MicrophoneError(
                f"The microphone{f' {device!r}' if device is not None else ''} cannot be opened: {_words(error)}.",
                hint="See what there is: python -m sounddevice",
            ) from error

    def _open(self, device: int | str | None) -> Any:
        """A stream at 16 kHz, or, where the device does not know that rate, at its own."""
        try:
            return self._input(device, SAMPLE_RATE_HZ)
        except self._library.PortAudioError:
            found: dict[str, Any] = self._library.query_devices(device, "input")
            rate_hz = int(found["default_samplerate"])
            if rate_hz == SAMPLE_RATE_HZ:
                raise
            import soxr

            self._resampler = soxr.ResampleStream(rate_hz, SAMPLE_RATE_HZ, 1, dtype="float32")
            return self._input(device, rate_hz)

    def _input(self, device: int | str | None, rate_hz: int) -> Any:
        return self._library.InputStream(
            samplerate=rate_hz,
            blocksize=int(rate_hz * _CHUNK_S),
            device=device,
            channels=1,
            dtype="float32",
            callback=self._take,
            finished_callback=self._finish,
        )

    def _take(self, sound: Any, frames: int, clock: Any, status: Any) -> None:
        """PortAudio's thread: copy and go."""
        del frames, clock, status
        mono = np.array(sound[:, 0], np.float32)
        if self._resampler is not None:
            mono = np.asarray(self._resampler.resample_chunk(mono), np.float32)
        with suppress(queue.Full):  # nobody took what came before in time
            self._chunks.put_nowait(to_int16(mono))

    def _finish(self) -> None:
        self._ended = True

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __iter__(self) -> Iterator[Samples]:
        """Chunks as they come.

        Raises:
            MicrophoneError: It was unplugged, or gives nothing any more.
        """
        while True:
            try:
                yield self._chunks.get(timeout=SILENT_S)
            except queue.Empty as error:
                # Silence is sound too: a microphone that is there gives chunks all the time.
                how = "ended" if self._ended else f"gave nothing for {SILENT_S:g} s"
                raise MicrophoneError(
                    f"The microphone {how}: it may have been unplugged.", hint="Plug it in and start again."
                ) from error

    def close(self) -> None:
        """Let go of the device and of what waits."""
        self._stream.close(ignore_errors=True)
        while not self._chunks.empty():
            self._chunks.get_nowait().fill(0)


def _words(error: Exception) -> str:
    return " ".join(str(error).split()).rstrip(".")[:200]
