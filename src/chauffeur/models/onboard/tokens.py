# pyright: reportMissingImports=false, reportUntypedBaseClass=false, reportUntypedFunctionDecorator=false, reportUnknownParameterType=false
"""The tokenizer of the on-board model: byte-level BPE, one token a digit, whole pieces of programs as one token."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from chauffeur.language.quantities import ONES, TENS
from chauffeur.planners.onboard.dialect import CONDITIONS, SKILLS, UNITS
from chauffeur.planners.onboard.prompt import ASK, BLANK, DRAFT, FENCE_CLOSE, FENCE_OPEN, REFUSE, SPECIAL, WISH

VOCABULARY: Final = 4096

PIECES: Final = (
    f"{FENCE_OPEN}def drive():\n",
    FENCE_CLOSE,
    "    yield from ",
    "    yield from wait(",
    "    if ",
    ":\n        yield from ",
    "    while not ",
    ":\n        yield autopilot()\n",
    ")\n",
    '"gently"',
    '"quickly"',
    ASK,
    REFUSE,
    *(f"{name}(" for name in (*SKILLS, *CONDITIONS, *UNITS)),
)
"""Program text that every reply is made of."""


def train_tokenizer(texts: Iterable[str]) -> Any:
    """A tokenizer for these texts; the same texts in the same order give the same one."""
    from tokenizers import AddedToken, Tokenizer, decoders, models, pre_tokenizers, trainers

    tokenizer: Any = Tokenizer(models.BPE())
    tokenizer.pre_tokenizer = pre_tokenizers.Sequence(
        [pre_tokenizers.Digits(individual_digits=True), pre_tokenizers.ByteLevel(add_prefix_space=False)]
    )
    tokenizer.decoder = decoders.ByteLevel()
    trainer = trainers.BpeTrainer(
        vocab_size=VOCABULARY - len(PIECES),
        special_tokens=list(SPECIAL),
        initial_alphabet=pre_tokenizers.ByteLevel.alphabet(),
        show_progress=False,
    )
    tokenizer.train_from_iterator(texts, trainer)
    tokenizer.add_tokens([AddedToken(piece, normalized=False, special=False) for piece in PIECES])
    return tokenizer


def load_tokenizer(folder: Path) -> Any:
    """The tokenizer of a model folder."""
    from tokenizers import Tokenizer

    return Tokenizer.from_file(str(folder / "tokenizer.json"))


@dataclass(frozen=True, slots=True)
class Blanks:
    """Settings for blanking words of wishes in training.

    Attributes:
        wish, draft: Tokens that open a wish and end it.
        blank: The token that stands for a word not heard.
        kept: Tokens that are never blanked: digits and number words, which a reply copies.
    """

    wish: int
    draft: int
    blank: int
    kept: frozenset[int]


def blanks_of(tokenizer: Any) -> Blanks:
    """The tokens of a tokenizer that blanking needs."""
    numbers = {*"0123456789", *ONES, *TENS, "hundred", "half", "point"}
    words: dict[str, int] = tokenizer.get_vocab()
    kept = frozenset(token for word, token in words.items() if word.replace("\u0120", "").lower() in numbers)
    return Blanks(words[WISH], words[DRAFT], words[BLANK], kept)
