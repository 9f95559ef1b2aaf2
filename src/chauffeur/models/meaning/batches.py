"""Composed sentences as tensors: an endless, seeded stream, made by worker processes while the network learns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import numpy as np
import torch
from torch import Tensor
from torch.utils.data import IterableDataset, get_worker_info

from chauffeur.language.meaning.pieces import WordPieces, read_vocabulary
from chauffeur.language.meaning.symbols import END, INDEX, MOST_SYMBOLS, POINTER, START, SYMBOLS, write
from chauffeur.models.meaning.banks import Bank
from chauffeur.models.meaning.composer import Composed, Composer
from chauffeur.models.meaning.highway import HighwaySentences
from chauffeur.models.meaning.labelled import together, varied
from chauffeur.models.meaning.noise import with_noise

WRITTEN_SHARE: Final = 0.6
HIGHWAY_SHARE: Final = 0.15
"""The rest is composed from phrases."""
JOINED_SHARE: Final = 0.12
"""Share of labelled sentences that are said together with another."""

Example = tuple[list[int], list[int], list[int]]
"""Ids of the text; symbols written; tokens pointed at (0 where none)."""


def example_of(sentence: Composed, pieces: WordPieces) -> Example | None:
    """A sentence as numbers; None where it is too long to be pointed into."""
    split = pieces.split(sentence.text)
    first = {word: at for at, word in reversed(list(enumerate(split.words))) if word >= 0}
    symbols, tokens = [INDEX[START]], [0]
    for one in write(sentence.acts, sentence.address):
        if isinstance(one, int):
            if one not in first:
                return None
            symbols.append(INDEX[POINTER])
            tokens.append(first[one])
        else:
            symbols.append(INDEX[one])
            tokens.append(0)
    symbols.append(INDEX[END])
    tokens.append(0)
    return None if len(symbols) > MOST_SYMBOLS else (list(split.ids), symbols, tokens)


class SentenceSource:
    """Draws sentences of all kinds by their shares."""

    def __init__(self, banks: Sequence[Bank], written: Sequence[Composed], rng: np.random.Generator) -> None:
        """Args: writers' phrases; sentences that writers labelled; what every choice is drawn from."""
        self._composers = [Composer(bank, rng) for bank in banks]
        self._highway = HighwaySentences(rng)
        self._written, self._rng = written, rng

    def draw(self) -> Composed:
        """A sentence."""
        share = self._rng.random()
        if self._written and share < WRITTEN_SHARE:
            return self._varied()
        if share < WRITTEN_SHARE + HIGHWAY_SHARE:
            return self._highway.sentence()
        return self._composers[int(self._rng.integers(len(self._composers)))].sentence()

    def _varied(self) -> Composed:
        """A labelled sentence, with another in front or behind now and then."""
        sentence = varied(self._written[int(self._rng.integers(len(self._written)))], self._rng)
        if self._rng.random() > JOINED_SHARE:
            return sentence
        other = varied(self._written[int(self._rng.integers(len(self._written)))], self._rng)
        return together(sentence, other) or sentence


class Sentences(IterableDataset[tuple[Tensor, ...]]):
    """Examples without end; each worker has a seed of its own."""

    def __init__(
        self, banks: Sequence[Bank], written: Sequence[Composed], vocabulary: Path, seed: int, batch: int
    ) -> None:
        """Args: writers' phrases; sentences that writers labelled; the vocabulary file; seed; examples a batch."""
        super().__init__()
        self._banks, self._written = tuple(banks), tuple(written)
        self._vocabulary, self._seed, self._batch = vocabulary, seed, batch

    def __iter__(self) -> Iterator[tuple[Tensor, ...]]:
        """Batches of sentences of like length, as tensors."""
        worker = get_worker_info()
        rng = np.random.default_rng((self._seed, 0 if worker is None else worker.id))
        pieces = WordPieces(read_vocabulary(self._vocabulary))
        draw = SentenceSource(self._banks, self._written, rng).draw
        while True:
            pool: list[Example] = []
            while len(pool) < 8 * self._batch:
                made = example_of(with_noise(draw(), rng), pieces)
                if made is not None:
                    pool.append(made)
            pool.sort(key=lambda one: len(one[0]))
            starts = np.arange(0, len(pool), self._batch)
            rng.shuffle(starts)
            for start in starts:
                yield tensors(pool[int(start) : int(start) + self._batch])


def tensors(examples: Sequence[Example]) -> tuple[Tensor, ...]:
    """(ids, mask, symbols, tokens, targets) of examples; a pointer's target is `len(SYMBOLS)` + its token."""
    long = max(len(one[0]) for one in examples)
    wide = max(len(one[1]) for one in examples)
    ids = torch.zeros(len(examples), long, dtype=torch.long)
    mask = torch.zeros(len(examples), long, dtype=torch.long)
    symbols = torch.zeros(len(examples), wide, dtype=torch.long)
    tokens = torch.zeros(len(examples), wide, dtype=torch.long)
    for row, (text, written, pointed) in enumerate(examples):
        ids[row, : len(text)] = torch.tensor(text)
        mask[row, : len(text)] = 1
        symbols[row, : len(written)] = torch.tensor(written)
        tokens[row, : len(written)] = torch.tensor(pointed)
    points = symbols == INDEX[POINTER]
    targets = torch.where(points, tokens + len(SYMBOLS), symbols)
    return ids, mask, symbols, tokens, targets
