"""Fenced blocks of a Markdown text."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

FENCE: Final = r"^[ \t]*(?P<marks>`{3,}|~{3,})[ \t]*(?P<label>[\w+.-]*)(?=[^\n`]*$)"
"""The line that opens or closes a block; only one without a label closes. For `re.MULTILINE`."""
_FENCE: Final = re.compile(FENCE)
_CODE_BEHIND: Final = re.compile(r"^([ \t]*`{3,}[ \t]*\w{1,12})[ \t]+((?:async )?def |import |from )")


@dataclass(frozen=True, slots=True)
class Block:
    """A fenced block.

    Attributes:
        label: What stands behind the opening marks, in lower case.
        body: The lines between the marks.
        start: Where its opening line begins in the text.
        end: Where its closing line ends; the end of the text where nothing closes it.
        closed: Whether there is a closing line.
    """

    label: str
    body: str
    start: int
    end: int
    closed: bool


def marks_on_own_lines(text: str) -> str:
    """A text whose fences stand on lines of their own: models write `yield autopilot()```` and `Here it is: ```python`.

    Code behind an opening fence moves to the next line, too.
    """
    if "```" not in text:
        return text
    lines: list[str] = []
    for line in text.split("\n"):
        head, marks, label = line.rpartition("```")
        if marks and head.strip(" \t`") and "`" not in head.rstrip("`") and _is_label(label):
            behind = head.rstrip("`")
            lines += [behind, line[len(behind) :]]
        else:
            lines.append(_CODE_BEHIND.sub(r"\1\n\2", line, count=1) if marks else line)
    return "\n".join(lines)


def _is_label(text: str) -> bool:
    return not text.strip() or text.strip().isidentifier()


def fenced_blocks(text: str) -> list[Block]:
    """The fenced blocks of a text, in order."""
    blocks: list[Block] = []
    opened: tuple[str, str, int, int] | None = None
    position = 0
    for line in text.split("\n"):
        end = position + len(line)
        match = _FENCE.match(line)
        if match is not None:
            marks, label = match["marks"], match["label"].lower()
            if opened is None:
                opened = (marks, label, position, end + 1)
            elif marks.startswith(opened[0]) and not label:
                blocks.append(Block(opened[1], text[opened[3] : position], opened[2], end, closed=True))
                opened = None
        position = end + 1
    if opened is not None:
        blocks.append(Block(opened[1], text[opened[3] :], opened[2], len(text), closed=False))
    return blocks


def without_blocks(text: str, blocks: list[Block]) -> str:
    """A text without some of its blocks."""
    parts: list[str] = []
    position = 0
    for block in blocks:
        parts.append(text[position : block.start].rstrip())
        position = block.end
    parts.append(text[position:].lstrip() if blocks else text)
    return "\n".join(parts).strip()
