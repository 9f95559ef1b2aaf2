"""Where a car is, and what map, rules and services know of that place, gathered within one budget of time.

    async with Sources(read_sources(Path("services.toml"))) as sources:
        surroundings = await sources.look()

Local map and rules answer at once. Services on the network are asked side by side; what has not come when the budget is
spent is told as missing or with its age, and is there for the next description. Nothing is asked over the network that
the settings do not name. Settings are written in a file by a person:

    region = "germany"
    map = "munich.osm.pbf"
    online = ["weather"]
    budget_s = 0.3

    [position]
    gpsd = "127.0.0.1:2947"        # or: at = [48.137, 11.575], heading_deg = 90
"""

from __future__ import annotations

import asyncio
import math
import os
import time
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, Self, TypeVar, get_args

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from chauffeur.concept import ConfigError
from chauffeur.concept.addresses import http_address, read_key
from chauffeur.describe.services.gps import Gpsd, Whereabouts, WrittenFix
from chauffeur.describe.services.http_source import HttpSource, Service
from chauffeur.describe.services.osm_file import load_road_map
from chauffeur.describe.services.overpass import OVERPASS
from chauffeur.describe.services.readings import Position, ServiceReading, Unknown
from chauffeur.describe.services.road_map import RoadMap, geometry
from chauffeur.describe.services.roads import RoadPlace, place_at
from chauffeur.describe.services.rules import Rules, load_rules
from chauffeur.describe.services.surroundings import Surroundings
from chauffeur.describe.services.toml_file import read_file
from chauffeur.describe.services.traffic import LEAST_CONFIDENCE, TOMTOM, TrafficReport
from chauffeur.describe.services.weather import OPEN_WEATHER

if TYPE_CHECKING:
    import httpx

T = TypeVar("T")

Online = Literal["weather", "map", "traffic"]
"""Services that are reached over the network."""

ONLINE: Final[tuple[Online, ...]] = get_args(Online)
URLS: Final[Mapping[Online, str]] = {
    "weather": "https://api.openweathermap.org",
    "map": "https://overpass-api.de",
    "traffic": "https://api.tomtom.com",
}
"""Servers that are asked unless others are named: they speak OpenWeather 2.5, Overpass, and TomTom's flow segments."""
BUDGET_S: Final = 0.3
"""How long one description of the place may wait for all services together."""
GPSD_PORT: Final = 2947

_MOST_BUDGET_S: Final = 60.0
_GRACE_S: Final = 0.5
"""What a look may take beyond its budget, for a busy machine; then it is given up."""
_EXAMPLE_URL: Final = "http://localhost:8080"


@dataclass(frozen=True, slots=True)
class SourceSettings:
    """Where a car's context comes from.

    Attributes:
        place: The place a person wrote down; or host and port of the daemon of the receiver that measures it.
        online: Services that may be asked over the network. Each learns about where the car is, so none is asked
            unless it is named here.
        urls: Servers of one's own, by service; the others are those of `URLS`.
        rules: Of the region; None where it is not known.
        road_map: A map in memory; with one, no map service is asked.
        budget_s: How long one look may wait for services.
        patience_s: After this long a request is given up; until then its answer is taken for the next description.
        name: Who says where the place is, e.g. the name of a file.

    Raises:
        ConfigError: There is no such service; an address is not one, or carries a secret; a time is out of range.
    """

    place: Position | tuple[str, int]
    online: Collection[Online] = ()
    urls: Mapping[Online, str] = field(default_factory=dict[Online, str])
    rules: Rules | None = None
    road_map: RoadMap | None = None
    budget_s: float = BUDGET_S
    patience_s: float = 8.0
    name: str = "the settings"

    def __post_init__(self) -> None:
        unknown = sorted({*self.online, *self.urls} - set(ONLINE))
        if unknown:
            raise ConfigError(f"There is no online service {unknown[0]!r}.", hint=f"Known: {', '.join(ONLINE)}.")
        checked = {
            name: http_address(self.urls.get(name, url), f"{name}_url", example=_EXAMPLE_URL).url
            for name, url in URLS.items()
        }
        object.__setattr__(self, "urls", checked)
        if not 0.0 < self.patience_s <= 60.0:
            raise ConfigError(f"patience_s is {self.patience_s:g}.", hint="Give seconds, above 0 and at most 60.")
        _check_budget(self.budget_s)


class Sources:
    """Services, map and rules of one car. Made in the event loop that asks; kept for the whole drive.

    Args:
        settings: What is asked.
        environ: Where keys are read from.
        clock: Unix time in seconds.
        rng: Spreads the waits after failures.
        transport: Answers in the place of the network: recorded replies.

    Raises:
        MissingExtraError: A map service is asked, and shapely is not installed.
        ConfigError: A key cannot be one, or would cross a public network unencrypted.
    """

    def __init__(
        self,
        settings: SourceSettings,
        *,
        environ: Mapping[str, str] = os.environ,
        clock: Callable[[], float] = time.time,
        rng: np.random.Generator | None = None,
        transport: httpx.AsyncBaseTransport | None = None,
    ) -> None:
        self._settings, self._environ, self._clock, self._transport = settings, environ, clock, transport
        self._rng = np.random.default_rng() if rng is None else rng
        off = "no such service is switched on"
        self._weather = self._source("weather", OPEN_WEATHER, off)
        self._traffic = self._source("traffic", TOMTOM, off)
        if "map" in settings.online:
            geometry()
        self._map: HttpSource[RoadMap] | Unknown = Unknown("no map is loaded")
        if settings.road_map is None:
            self._map = self._source("map", OVERPASS, "no map is loaded")
        place = settings.place
        self._where: Whereabouts = WrittenFix(place, settings.name) if isinstance(place, Position) else Gpsd(*place)

    @property
    def rules(self) -> Rules | None:
        """Rules of the region."""
        return self._settings.rules

    def place_words(self) -> str:
        """Who says where the car is; empty where that is not known."""
        return self._where.words()

    async def look(self, budget_s: float | None = None) -> Surroundings | Unknown:
        """What is known of the car's place now. Never raises, and never takes much longer than the budget.

        Args:
            budget_s: How long services may be waited for; default the settings'. 0 tells what is known already.
        """
        budget_s = self._settings.budget_s if budget_s is None else budget_s
        here = self._where.position()
        if isinstance(here, Unknown):
            return here
        try:
            async with asyncio.timeout(budget_s + _GRACE_S):
                return await self.around(here, budget_s=budget_s)
        except TimeoutError:
            return Unknown(f"the sources did not answer within {budget_s + _GRACE_S:g} s")
        except Exception as error:  # noqa: BLE001 - whatever a source dies of, a drive goes on without it
            return Unknown(f"the sources failed ({type(error).__name__})")

    async def around(self, here: Position, *, budget_s: float = BUDGET_S) -> Surroundings:
        """What is known of a place. Never raises for anything a service does, and never takes longer than the budget.

        Args:
            here: The place.
            budget_s: How long all services together may be waited for; 0 tells what is known already.

        Raises:
            ConfigError: The budget is not a time.
        """
        _check_budget(budget_s)
        running = {task for one in self._sources() if (task := one.start(here)) is not None}
        if running:
            await asyncio.wait(running, timeout=budget_s)
        now_s = self._clock()
        place = self._place(here, budget_s, now_s)
        return Surroundings(
            at=here,
            when_s=now_s,
            weather=_read(self._weather, here, budget_s),
            road=place.road,
            limit=place.limit,
            ahead=place.ahead,
            traffic=self._flow(here, budget_s),
            rules=self._told_rules(now_s),
        )

    async def close(self) -> None:
        """End what is under way, and close the connections."""
        await self._where.close()
        for source in self._sources():
            await source.close()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    def _sources(self) -> list[HttpSource[Any]]:
        return [one for one in (self._weather, self._map, self._traffic) if isinstance(one, HttpSource)]

    def _place(self, here: Position, budget_s: float, now_s: float) -> RoadPlace:
        if self._settings.road_map is not None:
            return place_at(self._settings.road_map, here, self._settings.rules, now_s)
        known = _read(self._map, here, budget_s)
        if isinstance(known, Unknown):
            return RoadPlace(known, known, known)
        return place_at(known.value, here, self._settings.rules, now_s, known.note)

    def _flow(self, here: Position, budget_s: float) -> ServiceReading[TrafficReport] | Unknown:
        known = _read(self._traffic, here, budget_s)
        if isinstance(known, Unknown):
            return known
        if known.value.confidence < LEAST_CONFIDENCE:
            return Unknown(f"the service is not sure of it: {known.value.confidence:.0%}")
        return replace(known, confidence=known.confidence * known.value.confidence)

    def _told_rules(self, now_s: float) -> ServiceReading[Rules] | Unknown:
        rules = self._settings.rules
        if rules is None:
            return Unknown("no region's rules are loaded")
        collected = datetime.strptime(rules.as_of, "%Y-%m").replace(tzinfo=UTC)
        return ServiceReading(rules, "", f"rules of {rules.name}", max(0.0, now_s - collected.timestamp()), 1.0)

    def _source(self, name: Online, service: Service[T], off: str) -> HttpSource[T] | Unknown:
        if name not in self._settings.online:
            return Unknown(off)
        url, key = self._settings.urls[name], ""
        if service.key is not None:
            address = http_address(url, "The service's address", example=_EXAMPLE_URL)
            found = read_key(address, (service.key[1],), self._environ)
            if found is None:
                return Unknown(f"there is no key: {service.key[1]} is not set")
            key = found[0]
        return HttpSource(
            service,
            url,
            key or None,
            patience_s=self._settings.patience_s,
            clock=self._clock,
            rng=self._rng,
            transport=self._transport,
        )


def _read(source: HttpSource[T] | Unknown, here: Position, waited_s: float) -> ServiceReading[T] | Unknown:
    return source.read(here, waited_s) if isinstance(source, HttpSource) else source


def _check_budget(budget_s: float) -> None:
    if not (math.isfinite(budget_s) and 0.0 <= budget_s <= _MOST_BUDGET_S):
        raise ConfigError(f"A budget of {budget_s:g} s cannot be used.", hint=f"Give seconds, 0 to {_MOST_BUDGET_S:g}.")


# The file.

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


class _File(_Table):
    position: _Position
    region: str = ""
    map: str = ""
    online: tuple[Online, ...] = ()
    budget_s: Annotated[float, Field(ge=0.0, le=10.0, allow_inf_nan=False)] = BUDGET_S
    urls: dict[Online, str] = {}


def read_sources(path: Path) -> SourceSettings:
    """Settings from a file, with the map and the rules it names; relative names are beside it.

    Raises:
        ConfigError: The file, the map or the rules cannot be read, or say what is not understood.
        DataError: The map cannot be used.
        MissingExtraError: A map is named, and no library reads it.
    """
    file = read_file(_File, path)
    at, region = file.position, file.region
    if at.at is not None:
        place: Position | tuple[str, int] = Position(*at.at, at.heading_deg, at.accuracy_m)
    else:
        assert at.gpsd is not None  # see `_Position`
        place = _address(at.gpsd)
    return SourceSettings(
        place,
        file.online,
        file.urls,
        rules=load_rules(str(path.parent / region) if region.endswith(".toml") else region) if region else None,
        road_map=load_road_map(path.parent / file.map) if file.map else None,
        budget_s=file.budget_s,
        name=path.name,
    )


def _address(text: str) -> tuple[str, int]:
    host, _, port = text.partition(":")
    return host, int(port or GPSD_PORT)
