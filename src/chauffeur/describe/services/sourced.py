"""What services know of a place, put into a driving context line by line, each with its source and age.

    context = with_sources(describe(observation), await sources.look())

`sources` is of `sources.py`. Any context will do, a simulated car's too, as long as somebody says where on the earth it
is meant to be.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Final

from chauffeur.concept import Context
from chauffeur.describe.services.readings import ServiceReading, Unknown
from chauffeur.describe.services.surroundings import Surroundings
from chauffeur.describe.services.units import age_words

FOR_SIMULATED: Final = frozenset({"weather", "traffic rules"})
"""What holds of a simulated car, too: its road, limits and traffic are its world's own."""


def with_sources(
    context: Context, found: Surroundings | Unknown, place: str = "", only: Collection[str] | None = None
) -> Context:
    """C with what is known of the place: behind its words, and in its `scene`, where the screening of words looks.

    Args:
        context: What the car itself sees.
        found: What services, map and rules know; or why it is not known where the car is.
        place: Who says where the car is, a whole sentence; empty to leave it out.
        only: Names of the lines to be told; all if left out.
    """
    lines = tuple((name, words) for name, words in told(found) if only is None or name in {*only, "place"})
    if place:
        lines = (("place", place), *lines)
    situation = replace(context.situation, scene=(*context.situation.scene, *lines))
    text = " ".join((context.text, *(words for _, words in lines))).strip()
    return replace(context, text=text, situation=situation)


def told(found: Surroundings | Unknown) -> tuple[tuple[str, str], ...]:
    """Each line of C with its name. What is known ends with who told it, and how old it is."""
    if isinstance(found, Unknown):
        return (("place", f"Weather, road, speed limit and traffic: not known ({found.reason})."),)
    readings = (found.weather, found.road, found.limit, found.ahead, found.traffic, found.rules)
    return tuple(
        (name, f"{words} {_source(reading)}".rstrip())
        for (name, words), reading in zip(found.scene(), readings, strict=True)
    )


def _source(reading: ServiceReading[object] | Unknown) -> str:
    if isinstance(reading, Unknown):
        return ""
    age = "of unknown age" if reading.age_s is None else f"{age_words(reading.age_s)} old"
    return f"(Source: {reading.source}, {age}.)"
