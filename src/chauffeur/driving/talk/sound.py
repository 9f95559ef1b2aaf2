"""The microphone of this machine, read beside everything else."""

from __future__ import annotations

import queue
import threading
from types import TracebackType
from typing import Final, Self

from chauffeur.speech import Microphone, MicrophoneError

_WAITING: Final = 200


class Sound:
    """Chunks of a microphone as they come. Use as a context manager.

    Attributes:
        trouble: Why nothing comes any more, in words; empty while it does.
    """

    def __init__(self, device: str = "") -> None:
        """Open it.

        Args:
            device: Number or part of its name; the system's choice if empty.

        Raises:
            MissingExtraError: sounddevice or PortAudio is not installed.
            MicrophoneError: There is no such microphone.
        """
        self._microphone = Microphone(int(device) if device.isdecimal() else device or None)
        self._chunks: queue.Queue[bytes] = queue.Queue(_WAITING)
        self.trouble = ""
        self._closing = False
        self._thread = threading.Thread(target=self._read, name="microphone", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._closing = True
        self._microphone.close()

    def take(self) -> list[bytes]:
        """What came since the last call."""
        chunks: list[bytes] = []
        while not self._chunks.empty():
            chunks.append(self._chunks.get())
        return chunks

    def _read(self) -> None:
        try:
            for chunk in self._microphone:
                if self._closing:
                    return
                if not self._chunks.full():  # nobody listens: the newest goes
                    self._chunks.put(chunk.astype("<i2").tobytes())
                chunk.fill(0)
        except MicrophoneError as error:
            if not self._closing:
                self.trouble = str(error)
