"""Words from outside are data: what hides in them is found, and they are quoted so that they stay data.

A wish, a remembered trip, a map name, a weather text and a model's reply are all written by somebody. `screen` looks
for instructions hidden in such a text and gives it back cleaned. A finding in a wish only marks it: people do say
"ignore what I said before, take the left lane", and what they may have is decided by the checks and limits, whatever
the words. In a text of a third party, who cannot be asked back, a finding withholds the text: the planner gets a
quoted, neutralised form of it. None of this is what keeps the car safe; the checks and limits are, and they hold for
any reply.

Everything here is a pure function of text that never raises.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final, Literal

from chauffeur.concept import Context, Feedback, History, HistoryItem, Instruction, PlanRequest
from chauffeur.language.letters import clean
from chauffeur.safety.concealment import MAX_READ_CHARS, Found, Kind, hidden_in

Source = Literal["wish", "history", "service", "reply"]
"""Author of a text: the passenger now; the passenger, or whoever used the name, earlier; a map, a weather or traffic
service, a sign; a model."""

MAX_CHARS: Final = 2_000
"""Longer texts are marked: as many characters as a wish may have."""

QUOTED_CHARS: Final = 200
"""Most characters of a withheld text that are shown."""

_WITHHOLDS: Final[dict[Source, frozenset[str]]] = {
    "wish": frozenset(),
    "reply": frozenset(),
    # A passenger's own remark may well say "ignore what I said"; nobody says a chat token or a program aloud.
    "history": frozenset({"role", "code", "control", "encoded", "long"}),
    "service": frozenset({"override", "role", "code", "control", "lookalike", "encoded", "long"}),
}
_EXPECTED: Final[dict[Source, frozenset[str]]] = {
    "wish": frozenset(),
    "history": frozenset(),
    "service": frozenset(),
    "reply": frozenset({"code", "override", "long"}),  # a reply is thoughts and a program, and may speak of the limits
}


@dataclass(frozen=True, slots=True)
class ScreeningFinding:
    """One thing found in a text.

    Attributes:
        kind: What it is.
        span: Where, as (first, behind the last) character of the text as it was given.
        words: What it says, decoded and in plain letters where it was disguised.
    """

    kind: Kind
    span: tuple[int, int]
    words: str


@dataclass(frozen=True, slots=True)
class Screened:
    """A text after screening.

    Attributes:
        text: What may go on: the cleaned text, or its quoted form where it is withheld.
        findings: What was found, in the order of the text.
        withheld: Whether `text` is the quoted form.
    """

    text: str
    findings: tuple[ScreeningFinding, ...] = ()
    withheld: bool = False

    @property
    def kinds(self) -> tuple[Kind, ...]:
        """Kinds found, each once."""
        return tuple(dict.fromkeys(finding.kind for finding in self.findings))


def screen(text: str, source: Source) -> Screened:
    """Screen a text: its findings, and the form of it that may go on.

    Args:
        text: Words from outside, of any length.
        source: Who wrote them; decides what a finding does.
    """
    findings = tuple(
        ScreeningFinding(kind, span, words)
        for kind, span, words in (*_found(text), *_too_long(text))
        if kind not in _EXPECTED[source]
    )
    findings = tuple(sorted(findings, key=lambda finding: finding.span))
    if _WITHHOLDS[source].isdisjoint(finding.kind for finding in findings):
        return Screened(clean(text), findings)
    kinds = ", ".join(dict.fromkeys(finding.kind for finding in findings))
    return Screened(f"withheld ({kinds}): {quote(text, QUOTED_CHARS)}", findings, withheld=True)


def quote(text: str, limit: int) -> str:
    """A text as one line between double quotes, without a double quote, back-tick, bracket of a tag or line end inside.

    Args:
        text: Words from outside.
        limit: Most characters to show of them.
    """
    shown = clean(text[: 4 * limit])
    body = " / ".join(line for line in shown.split("\n") if line).translate(_NEUTRAL)
    if len(body) > limit or len(text) > 4 * limit:
        body = f"{body[:limit].rstrip()} ..."
    return f'"{body}"'


@dataclass(frozen=True, slots=True)
class Noted:
    """A finding and the place it was found in: `wish`, `history 1`, or the name of a service's text."""

    place: str
    finding: ScreeningFinding
    withheld: bool


def screen_request(request: PlanRequest) -> tuple[PlanRequest, tuple[Noted, ...]]:
    """A request whose wish, history and service texts have been screened, and what was found in them.

    Service texts are those of `Situation.scene`; where the words of the context repeat one, it is replaced there too.
    Everything else of a context is written by the situation descriptors from numbers.
    """
    wish = screen(request.instruction.text, "wish")
    noted = [Noted("wish", finding, wish.withheld) for finding in wish.findings]
    context = _context(request.context, noted)
    items = tuple(
        _remembered(item, f"history {number}", noted) for number, item in enumerate(request.history.items, start=1)
    )
    rounds = tuple(replace(one, feedback=_one(one.feedback, "wish", "feedback", noted)) for one in request.rounds)
    instruction: Instruction = replace(request.instruction, text=wish.text)
    screened = replace(request, instruction=instruction, context=context, history=History(items), rounds=rounds)
    return screened, tuple(noted)


def _context(context: Context, noted: list[Noted]) -> Context:
    text = context.text
    scene: list[tuple[str, str]] = []
    for name, said in context.situation.scene:
        shown = _one(said, "service", name, noted)
        if said:
            text = text.replace(said, shown)
        scene.append((name, shown))
    return replace(context, text=text, situation=replace(context.situation, scene=tuple(scene)))


def _remembered(item: HistoryItem, place: str, noted: list[Noted]) -> HistoryItem:
    def one(text: str) -> str:
        return _one(text, "history", place, noted)

    feedback: tuple[Feedback, ...] = tuple(replace(said, text=one(said.text)) for said in item.feedback)
    # The program stays as it is: it is quoted in prompts, and what is made of it passes the checks.
    return replace(
        item,
        instruction=one(item.instruction),
        context=one(item.context),
        thoughts=one(item.thoughts),
        feedback=feedback,
    )


def _one(text: str, source: Source, place: str, noted: list[Noted]) -> str:
    found = screen(text, source)
    noted.extend(Noted(place, finding, found.withheld) for finding in found.findings)
    return found.text


def _found(text: str) -> Iterable[Found]:
    # What stands behind this point is not read, and a text that long is marked for its length.
    return hidden_in(text[:MAX_READ_CHARS])


def _too_long(text: str) -> Iterable[Found]:
    if len(text) > MAX_CHARS:
        yield "long", (MAX_CHARS, len(text)), f"{len(text)} characters"


_NEUTRAL: Final = str.maketrans({'"': "'", "`": "'", "<": "‹", ">": "›", "|": "¦", "{": "(", "}": ")", "\\": "/"})
