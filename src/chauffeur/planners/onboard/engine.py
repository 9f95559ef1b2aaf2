"""Runs the exported on-board model: ONNX Runtime for the network, a grammar for what it may write.

The model's folder holds `model.onnx` (keys and values of earlier tokens go in and come out), `tokenizer.json` and
`model.json`. Decoding is greedy, so the same prompt gives the same reply; every token that the grammar does not allow
is left out, and what the grammar leaves no choice about is not asked of the network.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import llguidance
import numpy as np

from chauffeur.concept import DataError
from chauffeur.language.exported import open_exported
from chauffeur.planners.onboard.prompt import END
from chauffeur.planners.onboard.reply import grammar

Array = np.ndarray[Any, Any]

MAX_PROMPT_TOKENS: Final = 320
MAX_REPLY_TOKENS: Final = 120


@dataclass(frozen=True, slots=True)
class Written:
    """The output of the model.

    Attributes:
        text: The reply, up to the end of the program.
        sure: Probability of the least likely choice it made among what the grammar allowed.
        tokens: Tokens of the reply.
        prompt_tokens: Tokens of the prompt.
        asked: How often the network was asked.
    """

    text: str
    sure: float
    tokens: int
    prompt_tokens: int
    asked: int


class Engine:
    """One model, loaded. Not to be used by two threads at once."""

    def __init__(self, folder: Path, *, threads: int = 1) -> None:
        """Load a model folder.

        Args:
            folder: Where the exported model is.
            threads: Threads of a forward pass.

        Raises:
            DataError: A file is missing or damaged.
        """
        try:
            self.about, self._session = open_exported(folder, threads)
            tokenizer_text = (folder / "tokenizer.json").read_text(encoding="utf-8")
        except Exception as error:  # the runtime raises types of its own for a damaged graph
            raise DataError(f"The on-board model in {folder} cannot be read: {error}.") from error
        self._tokenizer: Any = llguidance.LLTokenizer(tokenizer_text)
        (self._end,) = self._tokenizer.tokenize_str(END)
        layers, _, heads, _, width = (d if isinstance(d, int) else 0 for d in self._session.get_inputs()[1].shape)
        self._empty = np.zeros((layers, 1, heads, 0, width), np.float32)

    @cached_property
    def _replies(self) -> Any:
        return self._matcher(only_program=False)

    @cached_property
    def _programs(self) -> Any:
        return self._matcher(only_program=True)

    def _matcher(self, *, only_program: bool) -> Any:
        """At the beginning of a reply: kept and copied, because reading the grammar takes longer than most replies."""
        questions, reasons = tuple(self.about["questions"]), tuple(self.about["reasons"])
        text = grammar(questions, reasons, only_program=only_program)
        matchers: Any = llguidance.LLMatcher
        return matchers(self._tokenizer, matchers.grammar_from_lark(text))

    def write(
        self,
        prompt: str,
        *,
        only_program: bool = False,
        constrained: bool = True,
        told: Callable[[str], None] | None = None,
    ) -> Written:
        """The model's reply to a prompt.

        Args:
            prompt: As `prompt.prompt` makes it.
            only_program: Whether questions and refusals are left out.
            constrained: Whether the grammar holds; without it, whatever the network prefers.
            told: Called with each piece of text as it comes.
        """
        ids: list[int] = self._tokenizer.tokenize_str(prompt)[-MAX_PROMPT_TOKENS:]
        matcher = (self._programs if only_program else self._replies).deep_copy()
        keys = values = self._empty
        feed = ids
        out: list[int] = []
        sure, asked = 1.0, 0
        while len(out) < MAX_REPLY_TOKENS:
            logits, keys, values = self._session.run(
                None, {"ids": np.array([feed], np.int64), "keys": keys, "values": values}
            )
            asked += 1
            row = logits[0].astype(np.float64)
            if constrained:
                bias = np.frombuffer(matcher.compute_logit_bias(), np.uint8)[: len(row)]
                allowed = bias > 0
                if not allowed.any():
                    break
                row = np.where(allowed, row, -np.inf)
            token = int(row.argmax())
            sure = min(sure, 1.0 / float(np.exp(row - row[token]).sum()))
            if token == self._end:
                break
            feed = [token]
            if constrained:
                matcher.consume_token(token)
                forced: list[int] = [] if matcher.is_stopped() else matcher.compute_ff_tokens()
                if forced:
                    matcher.consume_tokens(forced)
                    feed += forced
            out += feed
            if told is not None:
                told(self._tokenizer.decode_str(feed))
            if constrained and matcher.is_stopped():
                break
        return Written(self._tokenizer.decode_str(out), sure, len(out), len(ids), asked)
