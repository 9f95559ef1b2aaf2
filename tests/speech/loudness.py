"""A detector for tests of what is built on detectors."""

from __future__ import annotations

import numpy as np

from chauffeur.speech.audio import Samples
from chauffeur.speech.detector import FRAME


class Loudness:
    """A detector for tests of what is built on detectors: a frame is voiced when it is loud."""

    def __init__(self) -> None:
        self.frames = 0

    def probability(self, frame: Samples) -> float:
        assert frame.shape == (FRAME,) and frame.dtype == np.int16
        self.frames += 1
        return float(np.abs(frame.astype(np.int32)).max() > 1000)

    def reset(self) -> None:
        self.frames = 0
