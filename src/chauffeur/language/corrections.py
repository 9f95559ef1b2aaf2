"""Self-corrections: "stay behind, no wait, overtake him"."""

from __future__ import annotations

import re
from typing import Final

from chauffeur.language.quantities import mark_quantities, number_of
from chauffeur.language.tokens import tokens_of

_VERBS: Final = (
    r"(?:go|stay|pass|overtake|keep|move|change|drive|slow|slower|speed|faster|quicker|left|right|park|take|let|follow|"
    r"wait|hang|do|don't|do not|near|get|turn|stop|hurry|the other)"
)
_TAKES_BACK: Final = re.compile(
    rf"(?<=\w)[\s,.;…-]+(?:"
    r"no,? wait|wait,? no|no,? no|(?:scratch|scrap|strike) that|forget (?:it|that|what i said)|never ?mind(?: that)?|"
    r"actually,? (?:no|don't|do not)|i said it wrong|not that|correction"
    rf")\b(?:[\s,.;:…-]+(?:sorry|uh|um|hmm|no|actually|rather|i mean|i meant|scratch that|strike that)){{0,4}}"
    rf"[,.;:…-]+\s*(?=\w)|(?<=\w)\s*[,.;…-]+\s*(?:(?:uh|um|oh|no|wait)[\s,]+){{0,4}}"
    rf"(?:sorry|actually|rather|i mean|i meant)[\s,.;:…-]+"
    rf"(?:(?:i mean|i meant|no|uh|um)[\s,]+){{0,4}}(?={_VERBS}\b)",
    re.IGNORECASE,
)
"""Words that take back those before them. The weaker ones ("sorry", "I mean") only before what may be a wish."""
_ANEW: Final = re.compile(
    r"^\s*(?:(?:no|oh|sorry|wait|actually|ok|okay)[\s,]+){0,2}(?:(?:i|we)(?:'ve| have)?\s+)?"
    r"(?:(?:a |had a )?chang(?:e|es|ed|ing) (?:of|my|our|the|in) (?:minds?|plans?)|new plan|different plan)"
    r"(?:[\s,.;:!…-]+(?:and|so))?[\s,.;:!…-]+(?=\w)",
    re.IGNORECASE,
)
"""Words ahead of a wish that take back the one that is driven: "change of mind: to the church"."""
_LEAST: Final = re.compile(r"[a-z]{3}", re.IGNORECASE)


_ONLY_A_PART: Final = re.compile(
    r"(?<=\w)\s{0,3}[,.;…-]{0,3}\s{1,3}"
    r"(?:(?:uh|um|oh|er|ah|hmm|no|wait|nope|sorry|actually|rather|or rather|i mean|i meant|"
    r"make (?:that|it)|correction|scratch that|strike that)\b[\s,.;:…-]{0,4}){1,6}"
    r"(?P<part>(?:(?:to|the|at|on|a|go|of) ){0,4}[\w.,/%'-]{1,24}(?: [\w.,/%'-]{1,24}){0,5}?)"
    r"(?:[\s,.;-]{1,4}(?:i mean|i meant|please|sorry|thanks|rather|instead)){0,3}\s{0,3}[.,;!]{0,3}\s{0,3}$",
    re.IGNORECASE,
)
"""What takes back no more than a side or a number, if that is all that follows: "turn right, no, left"."""
_SIDE: Final = re.compile(r"\b(?:left|right)\b(?! (?:now|away|here|behind|there|at|up|after)\b)", re.IGNORECASE)
_LEADS_IN: Final = frozenset(("to", "the", "at", "on", "a", "go", "of", "lane", "side", "one"))


def last_said(text: str) -> str:
    """A text after its self-corrections; the whole text if there are none.

    Where a mere side or number takes the place of another, the rest of the wish stays: "do seventy, no wait, sixty".
    """
    text = _ANEW.sub("", text.replace("’", "'"))
    if (mended := _with_part(text)) is not None:
        return mended
    parts = [part for part in _TAKES_BACK.split(text) if _LEAST.search(part)]
    return parts[-1] if len(parts) > 1 else text


def _with_part(text: str) -> str | None:
    """The text with its last side or number replaced by the one that was said after taking it back."""
    for found in _ONLY_A_PART.finditer(text):
        before, part = text[: found.start()], found["part"]
        if (sides := _SIDE.findall(part)) and {each.strip(",.;!") for each in part.lower().split()} <= {
            *_LEADS_IN,
            sides[0].lower(),
        }:
            said = [each for each in _SIDE.finditer(before) if each[0].lower() != sides[0].lower()]
            return None if not said else f"{before[: said[-1].start()]}{sides[0]}{before[said[-1].end() :]}"
        if (changed := _with_number(before, part)) is not None:
            return changed
    return None


def _with_number(before: str, part: str) -> str | None:
    """`do seventy km/h` and `sixty` make `do sixty km/h`; nothing where the part is more or less than one number."""
    new = [token for token in tokens_of(part.rstrip(".,;!")) if token not in _LEADS_IN]
    marked, amounts = mark_quantities(new)
    tokens = tokens_of(before)
    _, old = mark_quantities(tokens)
    if marked != ["#0"] or not old or not re.search(r"\d|[a-z]", old[-1].said):
        return None
    said = old[-1].said.split()
    at = max(k for k in range(len(tokens) - len(said) + 1) if tokens[k : k + len(said)] == said)
    unit = [] if amounts[0].dimension != "bare" else said[len(number_of(said)) :]
    if amounts[0].dimension not in ("bare", old[-1].dimension) and old[-1].dimension != "bare":
        return None
    return " ".join((*tokens[:at], *new, *unit, *tokens[at + len(said) :]))
