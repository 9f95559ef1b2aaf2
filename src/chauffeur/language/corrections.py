"""What somebody ends up saying who corrects themselves: "stay behind, no wait, overtake him"."""

from __future__ import annotations

import re
from typing import Final

_VERBS: Final = (
    r"(?:go|stay|pass|overtake|keep|move|change|drive|slow|slower|speed|faster|quicker|left|right|park|take|let|follow|"
    r"wait|hang|do|don't|do not|near|get|turn|stop|hurry|the other)"
)
_TAKES_BACK: Final = re.compile(
    rf"(?<=\w)[\s,.;…-]+(?:"
    r"no,? wait|wait,? no|no,? no|scratch that|strike that|forget (?:it|that|what i said)|never ?mind(?: that)?|"
    r"actually,? (?:no|don't|do not)|i said it wrong|not that|correction"
    rf")\b(?:[\s,.;:…-]+(?:sorry|uh|um|hmm|no|actually|rather|i mean|i meant|scratch that|strike that)){{0,4}}"
    rf"[,.;:…-]+\s*(?=\w)|(?<=\w)\s*[,.;…-]+\s*(?:(?:uh|um|oh|no|wait)[\s,]+){{0,4}}"
    rf"(?:sorry|actually|rather|i mean|i meant)[\s,.;:…-]+"
    rf"(?:(?:i mean|i meant|no|uh|um)[\s,]+){{0,4}}(?={_VERBS}\b)",
    re.IGNORECASE,
)
"""Words that take back those before them. The weaker ones ("sorry", "I mean") only before what may be a wish."""
_LEAST: Final = re.compile(r"[a-z]{3}", re.IGNORECASE)


def last_said(text: str) -> str:
    """What is left of a text when its speaker has corrected themselves; the whole text where they have not."""
    parts = [part for part in _TAKES_BACK.split(text.replace("’", "'")) if _LEAST.search(part)]
    return parts[-1] if len(parts) > 1 else text
