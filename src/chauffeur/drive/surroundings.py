"""Weather and traffic rules of a real place in a simulated drive's C, where the person keeps a file that says so.

The file is `services.toml` in the data folder (docs/services.md). Without it nothing is asked and nothing is said.
"""

from __future__ import annotations

from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Final

from chauffeur.concept import Context, Observation
from chauffeur.concept.data import data_home
from chauffeur.describe import describe_with_traffic
from chauffeur.describe.services.sourced import FOR_SIMULATED, with_sources
from chauffeur.describe.services.sources import Sources, SourceSettings

SERVICES_FILE: Final = "services.toml"


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
