"""Runs the exported on-board VLM with ONNX Runtime: no training library on board."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from chauffeur.concept import ActionMatrix, DataError
from chauffeur.language.exported import open_exported
from chauffeur.language.text_classifier import load_sorter
from chauffeur.planners.camera_faults import HEIGHT, WIDTH, small
from chauffeur.planners.vlm.sentences import load_head, shipped_encoder
from chauffeur.planners.vlm.template import DECIDED, GRADES, STYLES, TEMPLATE, GainCodebook
from chauffeur.planners.word_table import SHIPPED_WORDS, WordTable, load_words

Array = np.ndarray[Any, Any]

_TIED: Final = 0.8
"""Grades whose shares differ by less are tied: the processor's rounding moves a share by some hundredths."""
SHIPPED: Final = Path(__file__).parent / "weights"
"""The model that comes with the package."""
TRUST: Final = 90.0
"""Percent right on unseen scenes from which on a fact is told to people."""
BLIND: Final = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
"""Input where there is no picture."""


@dataclass(frozen=True, slots=True)
class VlmReading:
    """Output of the model for a wish and a picture.

    Attributes:
        values: Word of each slot of the template.
        policy: P.
        shares: How sure it was of each slot it decided, 0 to 1.
        text: The tokens, as people read them.
        passes: Forward passes.
    """

    values: Mapping[str, str]
    policy: ActionMatrix
    shares: Mapping[str, float]
    text: str
    passes: int


class VlmEngine:
    """One network, loaded. Not to be used by two threads at once."""

    def __init__(self, folder: Path = SHIPPED, *, threads: int = 1) -> None:
        """Load a model folder: `model.onnx`, `model.json`, and two more readers of the style, `styles.npz` and
        `head.npz`.

        Args:
            folder: Where it is.
            threads: Threads of a forward pass.

        Raises:
            DataError: A file is missing or damaged, or is of another template.
        """
        try:
            self.about, self._session = open_exported(folder, threads)
            self._codebook = GainCodebook({name: tuple(held) for name, held in self.about["codebook"].items()})
        except Exception as error:  # the runtime raises types of its own for a damaged graph
            raise DataError(
                f"The VLM in {folder} cannot be read: {error}.", hint="Train one: chauffeur model train vlm"
            ) from error
        if list(self.about.get("tokens", ())) != list(TEMPLATE.words):
            raise DataError(f"The VLM in {folder} writes other tokens.", hint="Train one: chauffeur model train vlm")
        self.words: WordTable = load_words(SHIPPED_WORDS)
        ear = folder / "styles.npz"
        self._ear = load_sorter(ear) if ear.exists() else None
        head = folder / "head.npz"
        self._head = load_head(head) if head.exists() else None
        self._network_share = float(self.about.get("network_share", 1.0))
        self._head_share = float(self.about.get("head_share", 1.0))
        self._worth = np.array(self.about.get("style_worth", np.eye(len(STYLES))), np.float64)

    @property
    def trusted(self) -> frozenset[str]:
        """Slots of a scene that it sees well enough to report: its own tests found `TRUST` percent right."""
        tested: Mapping[str, float] = self.about.get("figures", {}).get("test", {})
        return frozenset(name for name in ("grade", "lead", "road") if tested.get(name, 0.0) >= TRUST)

    @property
    def version(self) -> str:
        """Of the model; stands in every result."""
        return str(self.about["version"])

    def read(self, text: str, pixels: Array | None, given: Mapping[str, str]) -> VlmReading:
        """Decide the template token by token, the likeliest first to last.

        Args:
            text: The wish.
            pixels: The picture, (H, W, 3) uint8 of any size; None for none.
            given: Words of slots that are known: `task` and `recall`, and whatever is not the model's to decide.

        Raises:
            DataError: A given word may not stand in its slot.
        """
        words = self.words.vectors(self.words.tokens(text))[None]
        shown = small(BLIND if pixels is None else pixels).astype(np.float32) / 255.0
        feed = {"words": words, "pixels": shown[None]}
        row, shares, passes = TEMPLATE.canvas, dict[str, float](), 0
        slots = {slot.name: slot for slot in TEMPLATE.slots}
        for name, word in given.items():
            if word not in slots[name].words:
                raise DataError(f"Slot {name!r} cannot hold {word!r}.")
            row[TEMPLATE.places[name]] = TEMPLATE.ids[word]
        for name in DECIDED:
            if name in given:
                continue
            at = TEMPLATE.places[name]
            logits = np.asarray(self._session.run(None, {**feed, "rows": row[None]})[0][0, at], np.float64)
            raised = np.exp(logits - logits.max())
            raised /= raised.sum()
            if name == "style":
                row[at], shares[name] = self._style(text, raised)
            else:
                row[at] = _heavier(raised) if name == "grade" else int(logits.argmax())
                shares[name] = float(raised[row[at]])
            passes += 1
        values = {name: str(word) for name, word in TEMPLATE.decode(row).items()}
        return VlmReading(values, self._codebook.matrix(values), shares, TEMPLATE.text(row), passes)

    def _style(self, text: str, tokens: Array) -> tuple[int, float]:
        """(token of the style that is expected to fit best, how likely it is).

        Args:
            text: The wish.
            tokens: How likely the network finds each token.
        """
        ids = [TEMPLATE.ids[style] for style in STYLES]
        shares = tokens[ids]
        if self._ear is not None:
            heard = self._ear.shares(text, STYLES)
            shares = shares**self._network_share * np.array([heard[style] for style in STYLES])
        if self._head is not None:
            scores = self._head.scores(shipped_encoder().features(text))
            shares = shares * np.exp(self._head_share * (scores - scores.max()))
        shares = shares / max(float(shares.sum()), 1e-12)
        best = int((self._worth @ shares).argmax())
        return ids[best], float(shares[best])


@cache
def shipped() -> VlmEngine:
    """The model of the package, loaded once."""
    return VlmEngine()


def _heavier(shares: Array) -> int:
    """The token of the heaviest grade that is about as likely as the likeliest: a tie, which rounding would decide
    differently from run to run, never lowers care."""
    ids = [TEMPLATE.ids[grade] for grade in GRADES]
    best = int(shares.argmax())
    close = [one for one in ids if shares[one] >= _TIED * shares[best]]
    return close[-1] if best in ids else best
