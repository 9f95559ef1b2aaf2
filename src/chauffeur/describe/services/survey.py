"""All that can be known of a place, gathered at once and within one budget of time.

    async with ContextServices(ServiceSettings(online=frozenset({"weather"})), rules=load_rules("germany")) as services:
        surroundings = await services.around(Position(48.137, 11.575, heading_deg=90.0))

Local map and rules answer at once. Services on the network are asked side by side; what has not come when the budget is
spent is told as missing or with its age, and is there for the next description.
"""

from __future__ import annotations

import asyncio
import math
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Self, TypeVar

import numpy as np

from chauffeur.concept import ConfigError
from chauffeur.describe.services.http_source import HttpSource, Service
from chauffeur.describe.services.overpass import OVERPASS
from chauffeur.describe.services.readings import Position, ServiceReading, Unknown
from chauffeur.describe.services.road_map import RoadMap, geometry
from chauffeur.describe.services.roads import RoadPlace, place_at
from chauffeur.describe.services.rules import Rules
from chauffeur.describe.services.settings import BUDGET_S, Online, ServiceSettings, read_key
from chauffeur.describe.services.surroundings import Surroundings
from chauffeur.describe.services.traffic import LEAST_CONFIDENCE, TOMTOM, TrafficReport
from chauffeur.describe.services.weather import open_weather

if TYPE_CHECKING:
    import httpx

T = TypeVar("T")


class ContextServices:
    """Services, map and rules of one car. Made once; asked for every description.

    Args:
        settings: Which services are asked.
        rules: Rules of the region; None where it is not known.
        road_map: A map in memory; with one, no map service is asked.
        clock: Unix time in seconds.
        environ: Where keys are read from.
        rng: Spreads the waits after failures.
        transport: Answers in the place of the network: recorded replies.

    Raises:
        MissingExtraError: A map service is asked, and shapely is not installed.
        ConfigError: A key cannot be one, or would cross a public network unencrypted.
    """

    def __init__(
        self,
        settings: ServiceSettings,
        *,
        rules: Rules | None = None,
        road_map: RoadMap | None = None,
        clock: Callable[[], float] = time.time,
        environ: Mapping[str, str] = os.environ,
        rng: np.random.Generator | None = None,
        transport: httpx.AsyncBaseTransport | None = None,
    ) -> None:
        self._settings, self._environ, self._rules, self._road_map = settings, environ, rules, road_map
        self._clock = clock
        self._rng = np.random.default_rng() if rng is None else rng
        self._transport = transport
        off = "no such service is switched on"
        self._weather = self._source("weather", open_weather(settings.weather_decimals), settings.weather_url, off)
        self._traffic = self._source("traffic", TOMTOM, settings.traffic_url, off)
        if "map" in settings.online:
            geometry()
        self._map: HttpSource[RoadMap] | Unknown = Unknown("no map is loaded")
        if road_map is None:
            self._map = self._source("map", OVERPASS, settings.map_url, "no map is loaded")

    async def around(self, here: Position, *, budget_s: float = BUDGET_S) -> Surroundings:
        """What is known of a place. Never raises for anything a service does, and never takes longer than the budget.

        Args:
            here: The place.
            budget_s: How long all services together may be waited for; 0 tells what is known already.

        Raises:
            ConfigError: The budget is not a time.
        """
        if not (math.isfinite(budget_s) and 0.0 <= budget_s <= 60.0):
            raise ConfigError(f"A budget of {budget_s:g} s cannot be used.", hint="Give seconds, 0 to 60.")
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
        for source in self._sources():
            await source.close()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    def _sources(self) -> list[HttpSource[Any]]:
        return [one for one in (self._weather, self._map, self._traffic) if isinstance(one, HttpSource)]

    def _place(self, here: Position, budget_s: float, now_s: float) -> RoadPlace:
        if self._road_map is not None:
            return place_at(self._road_map, here, self._rules, now_s)
        known = _read(self._map, here, budget_s)
        if isinstance(known, Unknown):
            return RoadPlace(known, known, known)
        return place_at(known.value, here, self._rules, now_s, known.note)

    def _flow(self, here: Position, budget_s: float) -> ServiceReading[TrafficReport] | Unknown:
        known = _read(self._traffic, here, budget_s)
        if isinstance(known, Unknown):
            return known
        if known.value.confidence < LEAST_CONFIDENCE:
            return Unknown(f"the service is not sure of it: {known.value.confidence:.0%}")
        return replace(known, confidence=known.confidence * known.value.confidence)

    def _told_rules(self, now_s: float) -> ServiceReading[Rules] | Unknown:
        if self._rules is None:
            return Unknown("no region's rules are loaded")
        year, month = (int(one) for one in self._rules.as_of.split("-"))
        age_s = max(0.0, now_s - datetime(year, month, 1, tzinfo=UTC).timestamp())
        return ServiceReading(self._rules, "", f"rules of {self._rules.name}", age_s, 1.0)

    def _source(self, name: Online, service: Service[T], url: str, off: str) -> HttpSource[T] | Unknown:
        if name not in self._settings.online:
            return Unknown(off)
        key = None if service.key is None else read_key(service.key[1], url, self._environ)
        if service.key is not None and key is None:
            return Unknown(f"there is no key: {service.key[1]} is not set")
        return HttpSource(
            service,
            url,
            key,
            patience_s=self._settings.patience_s,
            clock=self._clock,
            rng=self._rng,
            transport=self._transport,
        )


def _read(source: HttpSource[T] | Unknown, here: Position, waited_s: float) -> ServiceReading[T] | Unknown:
    return source.read(here, waited_s) if isinstance(source, HttpSource) else source
