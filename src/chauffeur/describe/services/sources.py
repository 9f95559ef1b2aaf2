"""The file that says where a car's context comes from: its place, a map, a region, services; and asking them all.

    region = "germany"
    map = "munich.osm.pbf"
    online = ["weather"]
    budget_s = 0.3

    [position]
    gpsd = "127.0.0.1:2947"        # or: at = [48.137, 11.575], heading_deg = 90

A person writes it. Nothing is asked over the network that it does not name.
"""

from __future__ import annotations

import asyncio
import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from chauffeur.concept import ConfigError
from chauffeur.describe.services.gps import Gpsd, Whereabouts, WrittenFix
from chauffeur.describe.services.osm_file import load_road_map
from chauffeur.describe.services.readings import Position, Unknown
from chauffeur.describe.services.road_map import RoadMap
from chauffeur.describe.services.rules import Rules, load_rules
from chauffeur.describe.services.settings import (
    BUDGET_S,
    MAP_URL,
    TRAFFIC_URL,
    WEATHER_URL,
    Online,
    ServiceSettings,
)
from chauffeur.describe.services.surroundings import Surroundings
from chauffeur.describe.services.survey import ContextServices

GPSD_PORT: Final = 2947

_GRACE_S: Final = 0.5
"""What a look may take beyond its budget, for a busy machine; then it is given up."""

Degrees = Annotated[float, Field(allow_inf_nan=False)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class _Position(_Table):
    at: tuple[Degrees, Degrees] | None = None
    heading_deg: Degrees | None = None
    accuracy_m: Annotated[float, Field(gt=0.0, lt=1000.0)] = 5.0
    gpsd: Annotated[str, Field(pattern=r"^[A-Za-z0-9.-]+(:\d{1,5})?$")] | None = None

    @model_validator(mode="after")
    def _one(self) -> Self:
        if (self.at is None) == (self.gpsd is None):
            raise ValueError("give either at = [LATITUDE, LONGITUDE] or gpsd")
        if self.at is None and self.heading_deg is not None:
            raise ValueError("heading_deg belongs to at; gpsd measures its own")
        if self.gpsd is not None and not 0 < _address(self.gpsd)[1] < 65_536:
            raise ValueError(f"{self.gpsd} has no port")
        return self


class _Urls(_Table):
    weather: str = WEATHER_URL
    map: str = MAP_URL
    traffic: str = TRAFFIC_URL


class _File(_Table):
    position: _Position
    region: str = ""
    map: str = ""
    online: tuple[Online, ...] = ()
    budget_s: Annotated[float, Field(ge=0.0, le=10.0, allow_inf_nan=False)] = BUDGET_S
    urls: _Urls = _Urls()


@dataclass(frozen=True, slots=True)
class SourceSettings:
    """Where a car's context comes from, read from its file: map and rules are in memory already.

    Attributes:
        name: Name of the file.
        at: The place a person wrote down; None where it is measured.
        gpsd: Host and port of the receiver's daemon.
        services: Which services are asked, and where they are.
        rules: Of the region, if one is named.
        road_map: The map, if one is named.
        budget_s: How long one look may wait for services.
    """

    name: str
    at: Position | None
    gpsd: tuple[str, int] | None
    services: ServiceSettings
    rules: Rules | None
    road_map: RoadMap | None
    budget_s: float


def read_sources(path: Path) -> SourceSettings:
    """Read the file, with the map and the rules it names; relative names are beside it.

    Raises:
        ConfigError: The file, the map or the rules cannot be read, or say what is not understood.
        DataError: The map cannot be used.
        MissingExtraError: A map is named, and no library reads it.
    """
    try:
        file = _File.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"The context file {path} cannot be read: {error}.") from error
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{path} is no TOML: {error}.") from error
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "the file"
        words = first["msg"].removeprefix("Value error, ")
        raise ConfigError(f"{path}, {where}: {words}.", hint="See docs/services.md.") from error
    place = file.position
    region = file.region
    return SourceSettings(
        name=path.name,
        at=None if place.at is None else Position(*place.at, place.heading_deg, place.accuracy_m),
        gpsd=None if place.gpsd is None else _address(place.gpsd),
        services=ServiceSettings(
            online=frozenset(file.online),
            weather_url=file.urls.weather,
            map_url=file.urls.map,
            traffic_url=file.urls.traffic,
        ),
        rules=load_rules(str(path.parent / region) if region.endswith(".toml") else region) if region else None,
        road_map=load_road_map(path.parent / file.map) if file.map else None,
        budget_s=file.budget_s,
    )


def _address(text: str) -> tuple[str, int]:
    host, _, port = text.partition(":")
    return host, int(port or GPSD_PORT)


class Sources:
    """Asks the sources of one car. Made in the event loop that asks; kept for the whole drive."""

    def __init__(self, settings: SourceSettings, *, environ: Mapping[str, str] = os.environ) -> None:
        """Begin to look for the place.

        Args:
            settings: What is asked.
            environ: Where keys are read from.

        Raises:
            ConfigError: A key cannot be used.
        """
        self._services = ContextServices(
            settings.services, rules=settings.rules, road_map=settings.road_map, environ=environ
        )
        self._settings = settings
        if settings.at is not None:
            self._where: Whereabouts = WrittenFix(settings.at, settings.name)
        else:
            assert settings.gpsd is not None
            self._where = Gpsd(*settings.gpsd)

    @property
    def rules(self) -> Rules | None:
        """Rules of the region."""
        return self._settings.rules

    def place_words(self) -> str:
        """Who says where the car is; empty where that is not known."""
        return self._where.words()

    async def look(self, budget_s: float | None = None) -> Surroundings | Unknown:
        """What is known of the place now. Never raises, and never takes much longer than the budget.

        Args:
            budget_s: How long services may be waited for; default the file's. 0 tells what is known already.
        """
        budget_s = self._settings.budget_s if budget_s is None else budget_s
        here = self._where.position()
        if isinstance(here, Unknown):
            return here
        try:
            async with asyncio.timeout(budget_s + _GRACE_S):
                return await self._services.around(here, budget_s=budget_s)
        except TimeoutError:
            return Unknown(f"the sources did not answer within {budget_s + _GRACE_S:g} s")
        except Exception as error:  # noqa: BLE001 - whatever a source dies of, a drive goes on without it
            return Unknown(f"the sources failed ({type(error).__name__})")

    async def close(self) -> None:
        """End what is under way."""
        await self._where.close()
        await self._services.close()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()
