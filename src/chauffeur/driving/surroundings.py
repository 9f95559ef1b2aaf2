"""Weather and traffic rules of a real place in a simulated drive's C, where the person keeps a file that says so.

The file is `services.toml` in the data folder (docs/services.md). Without it nothing is asked and nothing is said.
"""

from __future__ import annotations

from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path
from typing import Final

from chauffeur.concept import Context, Observation
from chauffeur.concept.data import data_home
from chauffeur.concept.weather import Weather
from chauffeur.describe import describe_with_traffic
from chauffeur.describe.services.sourced import FOR_SIMULATED, with_sources
from chauffeur.describe.services.sources import Sources, SourceSettings
from chauffeur.driving.seat import Weathered
from chauffeur.language.weather import UNKNOWN, WEATHER_FACT, weather_of
from chauffeur.worlds.base import World

SERVICES_FILE: Final = "services.toml"
SKY: Final[dict[Weather, str]] = {
    "sunny": "The sky is clear and sunny; the road is dry.",
    "rain": "It is raining; the road is wet.",
    "fog": "There is fog; I see about 60 m, and the road is damp.",
    "snow": "It is snowing; the road is covered with snow.",
    "night": "It is night; the sky is clear and the road is dry.",
}
"""What C says of each weather that a world knows."""


def services_file() -> Path | None:
    """The person's file; None where there is none."""
    path = data_home() / SERVICES_FILE
    return path if path.is_file() else None


@asynccontextmanager
async def opened(where: SourceSettings | None) -> AsyncGenerator[Sources | None]:
    """The sources of some settings, while they are used; None where there are none."""
    if where is None:
        yield None
        return
    async with Sources(where) as sources:
        yield sources


async def describing(
    sources: Sources | None, describe: Callable[[Observation], Context] = describe_with_traffic
) -> Callable[[Observation], Context]:
    """How C is made with what the sources know by now; bounded in time, and never an error of theirs.

    Without sources, of what `describe` says alone.
    """
    if sources is None:
        return describe
    found = await sources.look()
    return lambda observation: with_sources(describe(observation), found, sources.place_words(), FOR_SIMULATED)


def weathered(world: World, describe: Callable[[Observation], Context]) -> Callable[[Observation], Context]:
    """How C is made in a world that knows what the sky does, as a car's own instruments would tell it; what a weather
    service says stands."""

    def told(observation: Observation) -> Context:
        context = describe(observation)
        if not isinstance(world, Weathered) or weather_of(context.situation) != UNKNOWN:
            return context
        sky = SKY[world.weather]
        situation = replace(context.situation, scene=(*context.situation.scene, (WEATHER_FACT, sky)))
        return replace(context, text=f"{context.text} Weather here: {sky}".strip(), situation=situation)

    return told
