"""The learned parser: a text to acts, written symbol by symbol under the grammar.

An encoder of 22 M parameters reads the text once; a decoder of two layers writes symbols and points at the text. Both
run on one thread of a processor. `chauffeur.models.meaning` makes the files.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from chauffeur.concept import DataError
from chauffeur.concept.utterance import Address
from chauffeur.language.exported import open_graph
from chauffeur.language.meaning.pieces import Pieces, WordPieces, read_vocabulary
from chauffeur.language.meaning.symbols import (
    END,
    INDEX,
    MOST_SYMBOLS,
    POINTER,
    START,
    SYMBOLS,
    ActGrammar,
    Written,
    WrittenAct,
    parse,
)

ENCODER, DECODER, PIECES = "encoder.onnx", "decoder.onnx", "vocab.txt"
WEIGHTS: Final = Path(__file__).parent / "weights"


@dataclass(frozen=True, slots=True)
class Parsed:
    """Output of the parser for a text.

    Attributes:
        acts: With tokens of `pieces` as pointers.
        address: For whom the words are.
        log_probability: Of the whole string, natural logarithm.
        pieces: The text's tokens.
    """

    acts: tuple[WrittenAct, ...]
    address: Address
    log_probability: float
    pieces: Pieces


class Parser:
    """A parser, loaded. Not to be used by two threads at once."""

    def __init__(self, folder: Path = WEIGHTS, threads: int = 1) -> None:
        """Args: where its files lie; threads of a pass. Raises DataError: a file is missing or damaged."""
        try:
            self._encoder: Any = open_graph(folder / ENCODER, threads)
            self._decoder: Any = open_graph(folder / DECODER, threads)
            self._pieces = WordPieces(read_vocabulary(folder / PIECES))
        except Exception as error:  # the runtime raises types of its own for a damaged graph
            raise DataError(
                f"The parser of meaning in {folder} cannot be read: {error}.",
                hint="Install Chauffeur again; it ships with it.",
            ) from error

    def parse(self, text: str) -> Parsed:
        """The acts that a text asks for; greedy, under the grammar."""
        pieces = self._pieces.split(text)
        memory = self._encoder.run(None, {"ids": np.array([pieces.ids], np.int64)})[0]
        pointable = np.array([word >= 0 for word in pieces.words])
        grammar = ActGrammar()
        out: list[Written] = []
        symbols, tokens = [INDEX[START]], [0]
        total = 0.0
        while len(symbols) < MOST_SYMBOLS:
            feed = {
                "written": np.array([symbols], np.int64),
                "positions": np.array([tokens], np.int64),
                "memory": memory,
            }
            scores = self._decoder.run(None, feed)[0][0].astype(np.float64)
            allowed = np.full(len(scores), -math.inf)
            may = grammar.allowed()
            for symbol in may:
                if symbol == POINTER:
                    allowed[len(SYMBOLS) :] = np.where(pointable, 0.0, -math.inf)
                else:
                    allowed[INDEX[symbol]] = 0.0
            held = scores + allowed
            best = int(held.argmax())
            # The share is that among all symbols: what the grammar had to forbid counts against the reading.
            total += float(scores[best] - _log_sum(scores))
            symbol = POINTER if best >= len(SYMBOLS) else SYMBOLS[best]
            grammar.take(symbol)
            if symbol == END:
                break
            out.append(best - len(SYMBOLS) if symbol == POINTER else symbol)
            symbols.append(INDEX[symbol])
            tokens.append(best - len(SYMBOLS) if symbol == POINTER else 0)
        acts, address = parse(out)
        return Parsed(tuple(acts), address, total, pieces)


def _log_sum(scores: np.ndarray) -> float:
    top = float(scores.max())
    return top + math.log(float(np.exp(scores - top).sum()))


@cache
def shipped_parser() -> Parser:
    """The parser of the package, loaded once."""
    return Parser()


def spans_of(parsed: Parsed, tokens: Sequence[int]) -> tuple[int, int]:
    """Characters from the word of the first of some tokens to the word of the last."""
    pieces = parsed.pieces
    words = [pieces.words[token] for token in tokens]
    inside = [span for span, word in zip(pieces.spans, pieces.words, strict=True) if min(words) <= word <= max(words)]
    return min(low for low, _ in inside), max(high for _, high in inside)
