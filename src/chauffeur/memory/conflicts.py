"""Where a person said one thing on one day and the opposite on another: both, with their dates, and which one holds.

The rule is one and simple: the most recent words hold. What somebody says of a trip is held against what they said of
other trips, and what they wished for against other wishes; a wish and the remark that follows it ("drive faster",
"too fast") belong together. What was said on another kind of road, or in other weather, contradicts nothing.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Final, Literal

from chauffeur.concept import Feedback, History, HistoryItem
from chauffeur.language import measured
from chauffeur.language.weather import weather_in
from chauffeur.memory.plain_text import clauses, even
from chauffeur.memory.similarity import tags_of

Subject = Literal["speed", "gap", "style", "lane", "overtaking"]
Source = Literal["feedback", "wish"]

SUBJECTS: Final[tuple[Subject, ...]] = ("speed", "gap", "style", "lane", "overtaking")

_TAGS: Final[dict[str, tuple[Subject, int]]] = {
    "speed+": ("speed", 1), "speed-": ("speed", -1), "gap+": ("gap", 1), "gap-": ("gap", -1),
    "comfort+": ("style", 1), "comfort-": ("style", -1), "lane.right": ("lane", 1), "lane.left": ("lane", -1),
    "overtake": ("overtaking", 1), "not.overtake": ("overtaking", -1),
}  # fmt: skip
_CHANGE: Final = re.compile(
    r"\b(?:more|less|faster|quicker|slower|closer|nearer|further|farther|bigger|larger|smaller|shorter|longer|wider"
    r"|increase|decrease|reduce|raise|lower|extra|another|over|under|above|below|by)\b"
)
"""A number beside one of these is an amount to change by, not one to keep."""

_GAP: Final = re.compile(r"\b(?:gap|distance|space|room|headway|clearance|behind|follow\w*|apart)\b")
_CLASH: Final = 0.1
"""Numbers clash where they differ by more than this part of the larger one."""

_QUOTED_CHARS: Final = 80
_MONTHS: Final = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")


@dataclass(frozen=True, slots=True)
class Side:
    """One side of a conflict.

    Attributes:
        trip_id: The trip it was said of, or for.
        when: Its time, ISO 8601 UTC.
        words: What the person said, on one line and cut.
        source: Whether they said it of a drive or wished for it.
        direction: -1 or +1, with the signs of `Feedback` (lane: left and right; overtaking: do not, and do); 0 for
            none.
        value: A number to keep, in m/s, m or s; None for none.
        measure: What the number measures: `speed`, `distance` or `time`; empty for none.
    """

    trip_id: str
    when: str
    words: str
    source: Source
    direction: int = 0
    value: float | None = None
    measure: str = ""

    def contradicts(self, other: Side) -> bool:
        """Whether both cannot be done: numbers that clash, or else opposite directions."""
        if self.value is not None and other.value is not None and self.measure == other.measure:
            return abs(self.value - other.value) > _CLASH * max(abs(self.value), abs(other.value))
        return self.direction * other.direction < 0


@dataclass(frozen=True, slots=True)
class Conflict:
    """Two things a person said that do not go together.

    Attributes:
        subject: What they are about.
        earlier: The one that no longer holds.
        used: The one that holds.
    """

    subject: Subject
    earlier: Side
    used: Side

    def to_person(self, now: datetime | None = None) -> str:
        """The sentence for the person.

        Args:
            now: Present time with the person's time zone, for "today" and "yesterday"; without it, plain dates.
        """
        first, second = _day(self.earlier.when, now), _day(self.used.when, now)
        return f'You said "{self.earlier.words}" {first} and "{self.used.words}" {second}; I go by the later.'

    def to_model(self) -> str:
        """The line for a model. It quotes the person, so it is data like the trips themselves."""
        said = (
            f'"{side.words}" ({"said of the drive" if side.source == "feedback" else "wished"} {side.when[:16]})'
            for side in (self.earlier, self.used)
        )
        return f"{self.subject}: {' is contradicted by '.join(said)}; the later one holds."


def conflicts_in(history: History) -> tuple[Conflict, ...]:
    """Conflicts among remembered trips, at most one a subject and source, in the order of `SUBJECTS`.

    The side that is used is the newest; the other one is the newest before it that contradicts it.

    Args:
        history: What memory recalled, in any order.
    """
    items = sorted(history.items, key=lambda item: item.when)
    places = [(item.world, weather_in(item.context)) for item in items]
    sources: tuple[Source, ...] = ("feedback", "wish")
    found: list[Conflict] = []
    for source in sources:
        sides = [dict(_sides(item, source)) for item in items]
        for subject in SUBJECTS:
            said = [(place, one[subject]) for place, one in zip(places, sides, strict=True) if subject in one]
            if (earlier := _contradicted(said)) is not None:
                found.append(Conflict(subject, earlier, said[-1][1]))
    return tuple(sorted(found, key=lambda one: SUBJECTS.index(one.subject)))


def _contradicted(said: Sequence[tuple[tuple[str, int], Side]]) -> Side | None:
    """Of what was said on a subject, oldest first, the newest that the last one contradicts."""
    if not said:
        return None
    (world, weather), last = said[-1]
    for (other_world, other_weather), side in reversed(said[:-1]):
        elsewhere = world != other_world or (weather and other_weather and not weather & other_weather)
        if not elsewhere and last.contradicts(side):
            return side
    return None


def _sides(item: HistoryItem, source: Source) -> Iterator[tuple[Subject, Side]]:
    """What an item says on each subject; of several remarks on one subject the last comes last."""
    if source == "wish":
        yield from _read(item, source, item.instruction, {})
    else:
        for feedback in item.feedback:
            yield from _read(item, source, feedback.text, _signs(feedback))


def _signs(feedback: Feedback) -> dict[Subject, int]:
    signs: dict[Subject, int] = {"speed": feedback.speed, "gap": feedback.gap, "style": feedback.comfort}
    return {subject: sign for subject, sign in signs.items() if sign}


def _read(item: HistoryItem, source: Source, text: str, signs: dict[Subject, int]) -> Iterator[tuple[Subject, Side]]:
    """What words say on each subject; where there are signs already, words add only what signs do not know of."""
    directions = dict(signs)
    for tag in tags_of(text):
        if tag in _TAGS and (source == "wish" or _TAGS[tag][0] in ("lane", "overtaking")):
            subject, sign = _TAGS[tag]
            directions[subject] = 0 if directions.get(subject, sign) != sign else sign
    numbers = _numbers(text)
    words = " ".join(text.split()).replace('"', "'")
    quoted = words if len(words) <= _QUOTED_CHARS else words[: _QUOTED_CHARS - 1] + "…"
    for subject in SUBJECTS:
        direction, (measure, value) = directions.get(subject, 0), numbers.get(subject, ("", None))
        if direction or value is not None:
            yield subject, Side(item.trip_id, item.when, quoted, source, direction, value, measure)


def _numbers(text: str) -> dict[Subject, tuple[str, float]]:
    """Numbers to keep to; "10 km/h faster" and "in 200 m" are none."""
    found: dict[Subject, tuple[str, float]] = {}
    for clause in clauses(even(text)):
        if _CHANGE.search(clause):
            continue
        for measure, value in measured(clause):
            if measure == "speed":
                found["speed"] = measure, value
            elif _GAP.search(clause):
                found["gap"] = measure, value
    return found


def _day(when: str, now: datetime | None) -> str:
    try:
        moment = datetime.fromisoformat(when)
    except ValueError:
        return "once"
    if now is None or now.tzinfo is None or moment.tzinfo is None:
        return f"on {when[:10]}"
    day, today = moment.astimezone(now.tzinfo).date(), now.date()
    days = (today - day).days
    if days == 0:
        return f"today at {moment.astimezone(now.tzinfo):%H:%M}"
    if days == 1:
        return "yesterday"
    year = "" if day.year == today.year else f" {day.year}"
    return f"on {day.day} {_MONTHS[day.month - 1]}{year}"
