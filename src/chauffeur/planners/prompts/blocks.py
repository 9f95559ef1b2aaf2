"""Data blocks: words from outside, quoted so that they can only ever be read as data.

Passengers, road signs, place names and remembered text reach the model through here. A block's lines all start with
`| `, so no line can close its block or open another; invisible characters are dropped and dressed letters become plain
ones, so that nothing turns into a control token behind our back; what a chat template or a tokenizer could take for one
is defused; lengths are capped.
"""

from __future__ import annotations

import re
from typing import Final

from chauffeur.language.letters import clean

__all__ = ["cap", "clean", "data_block", "defuse", "program_block"]

INSTRUCTION_CHARS = 1_000
CONTEXT_CHARS = 4_000
HISTORY_FIELD_CHARS = 600
HISTORY_POLICY_CHARS = 2_000
HISTORY_ITEMS = 5
FEEDBACK_CHARS = 2_000
PROGRAM_CHARS = 8_000

_NAME = re.compile(r"[a-z][a-z0-9_-]{0,31}")
# `<|im_start|>`, DeepSeek's full-width bars, `<s>`, `</data>`, `<start_of_turn>`, `[INST]`: what models' templates use.
_BAR_OPEN = re.compile(r"<(?=\s*[|｜])")
_BAR_CLOSE = re.compile(r"(?<=[|｜])>")
_TAG = re.compile(r"<((?:\s*/\s*)?[A-Za-z_][\w:.-]*(?:\s[^<>]{0,200})?/?)>")
_LIKE_SIGNS: Final = str.maketrans("❬❮⟨〈˂ᐸ❭❯⟩〉˃ᐳ∣ǀ❘", "<<<<<<>>>>>>|||")
"""Brackets and bars that some tokenizers, and all people, take for those of a control token."""
_BRACKET = re.compile(r"\[(/?[A-Z][A-Z_]{2,40})\]")


def cap(text: str, limit: int) -> str:
    """At most `limit` characters of text, with a note where more were left out."""
    return text if len(text) <= limit else f"{text[:limit]} [... the rest is left out]"


def defuse(text: str) -> str:
    """Text in which nothing looks like a control token or a block border; comparisons in programs stay as they are."""
    text = _BAR_CLOSE.sub("›", _BAR_OPEN.sub("‹", text.translate(_LIKE_SIGNS)))
    return _BRACKET.sub(r"(\1)", _TAG.sub(r"‹\1›", text))


def data_block(name: str, text: str, limit: int) -> str:
    """A quoted block.

    Args:
        name: What it holds; ours, never from outside.
        text: The words from outside.
        limit: Most characters to keep.
    """
    if not _NAME.fullmatch(name):
        raise ValueError(f"{name!r} is not a block name")
    # The cap comes before cleaning as well, so that a huge text costs nothing; quoting may grow it a little.
    body = defuse(cap(clean(text[: 4 * limit]), limit))
    quoted = "\n".join(f"| {line}".rstrip() for line in body.split("\n")) if body else "| (empty)"
    return f'<data name="{name}">\n{quoted}\n</data>'


def program_block(source: str) -> str:
    """A program in a fence longer than any run of back-ticks inside, for the model's own earlier turns."""
    body = cap(source.strip("\n"), PROGRAM_CHARS)
    longest = max((len(run) for run in re.findall(r"`{3,}", body)), default=2)
    fence = "`" * (longest + 1)
    return f"{fence}python\n{body}\n{fence}"
