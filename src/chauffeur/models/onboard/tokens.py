# pyright: reportMissingImports=false, reportUntypedBaseClass=false, reportUntypedFunctionDecorator=false, reportUnknownParameterType=false
"""The tokenizer of the on-board model: byte-level BPE, one token a digit, whole pieces of programs as one token."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

from chauffeur.planners.onboard.dialect import CONDITIONS, SKILLS, UNITS
from chauffeur.planners.onboard.prompt import ASK, CONTEXT, END, FENCE_CLOSE, FENCE_OPEN, HISTORY, REFUSE, REPLY, WISH

VOCABULARY: Final = 2048

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
    special = [END, CONTEXT, HISTORY, WISH, REPLY]
    trainer = trainers.BpeTrainer(
        vocab_size=VOCABULARY - len(PIECES),
        special_tokens=special,
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
