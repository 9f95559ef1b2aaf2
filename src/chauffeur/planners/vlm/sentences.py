"""Sentence embeddings, and the style of driving that they ask for: a second reader beside the network.

    all-MiniLM-L6-v2 (frozen, int8) --> features --+--> style
    marks of the words (language.sorter) ----------+

The encoder has read a good part of the world's English; the network and the sorter have read some thousand sentences.
`benchmarks/shipped_words.py` makes `encoder.onnx` from the open checkpoint, `models.vlm.ear` the head.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any, Final
from zipfile import BadZipFile

import numpy as np

from chauffeur.concept import DataError
from chauffeur.language.exported import open_graph
from chauffeur.planners.word_table import SHIPPED_WORDS, load_words

Array = np.ndarray[Any, Any]

LAYERS: Final = (3, 4, 5, 6)
"""Whose mean hidden states are the features: the last ones know topics best, the middle ones who does what to whom."""
FEATURES: Final = 384 * len(LAYERS)
ENCODER: Final = Path(__file__).parent / "weights" / "encoder.onnx"


class SentenceEncoder:
    """The frozen encoder, loaded. Not to be used by two threads at once."""

    def __init__(self, path: Path = ENCODER, threads: int = 1) -> None:
        """Args: the graph, and threads of a forward pass. Raises DataError: it is missing or damaged."""
        try:
            self._session = open_graph(path, threads)
        except Exception as error:  # the runtime raises types of its own for a damaged graph
            raise DataError(
                f"The sentence encoder {path} cannot be read: {error}.",
                hint="Install Chauffeur again; it ships with it.",
            ) from error
        self._words = load_words(SHIPPED_WORDS)

    def features(self, text: str) -> Array:
        """float32, (FEATURES,)."""
        # The graph's own beginning and end of a sentence follow after the pieces' numbers.
        first, last = len(self._words.pieces), len(self._words.pieces) + 1
        ids = np.array([[first, *self._words.tokens(text), last]], np.int64)
        return np.asarray(self._session.run(None, {"ids": ids})[0][0], np.float32)


@cache
def shipped_encoder() -> SentenceEncoder:
    """The encoder of the package, loaded once."""
    return SentenceEncoder()


class StyleHead:
    """Features to logarithms of the styles' shares: a layer of several small networks, whose findings are averaged."""

    def __init__(self, first: Array, bias: Array, second: Array, last: Array) -> None:
        """Put together.

        Args:
            first, bias: Of the hidden layers, (FEATURES, N) and (N,); features are taken as they are.
            second, last: (N, styles) and (styles,).
        """
        self.first, self.bias, self.second, self.last = first, bias, second, last

    def scores(self, features: Array) -> Array:
        """Scores (styles,) of a sentence's features (FEATURES,)."""
        hidden = np.maximum(features @ self.first.astype(np.float32) + self.bias, 0.0)
        return np.asarray(hidden @ self.second + self.last, np.float64)

    def store(self, path: Path) -> None:
        """Write what `load_head` reads."""
        np.savez_compressed(path, first=self.first, bias=self.bias, second=self.second, last=self.last)


def load_head(path: Path) -> StyleHead:
    """A stored head. Raises DataError for a file that is missing or damaged."""
    try:
        with np.load(path, allow_pickle=False) as held:
            found = StyleHead(held["first"], held["bias"], held["second"], held["last"])
    except (OSError, KeyError, ValueError, BadZipFile) as error:
        raise DataError(f"The style head {path} cannot be read: {error}.") from error
    if found.first.shape[0] != FEATURES:
        raise DataError(f"The style head {path} is of another encoder.")
    return found
