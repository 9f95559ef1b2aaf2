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
from typing import Final, Self

import numpy as np

from chauffeur.concept import ConfigError
from chauffeur.describe.services import overpass, traffic, weather
from chauffeur.describe.services.http_request import ServiceCaller
from chauffeur.describe.services.overpass import Overpass
from chauffeur.describe.services.readings import Position, ServiceReading, Unknown
from chauffeur.describe.services.remote import Remote
from chauffeur.describe.services.road_map import RoadMap
from chauffeur.describe.services.roads import RoadPlace, place_at
from chauffeur.describe.services.rules import Rules
from chauffeur.describe.services.settings import BUDGET_S, TRAFFIC_KEY, WEATHER_KEY, ServiceSettings, read_key
from chauffeur.describe.services.surroundings import Surroundings
from chauffeur.describe.services.traffic import LEAST_CONFIDENCE, TomTom, TrafficReport
from chauffeur.describe.services.weather import OpenWeather, Weather

_OFF: Final = "no such service is switched on"


class ContextServices:
    """Services, map and rules of one car. Made once; asked for every description.

    Args:
        settings: Which services are asked.
        rules: Rules of the region; None where it is not known.
        road_map: A map in memory; with one, no map service is asked.
        clock: Unix time in seconds.
        environ: Where keys are read from.
        rng: Spreads the waits after failures.

    Raises:
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
    ) -> None:
        self._settings = settings
        self._environ = environ
        self._rules = rules
        self._road_map = road_map
        self._clock = clock
        self._rng = np.random.default_rng() if rng is None else rng
        self._callers: list[ServiceCaller] = []
        self._weather = self._open_weather()
        self._traffic = self._tomtom()
        self._map = self._overpass()

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
        remotes = [one for one in (self._weather, self._map, self._traffic) if isinstance(one, Remote)]
        running = {task for one in remotes if (task := one.start(here)) is not None}
        if running:
            await asyncio.wait(running, timeout=budget_s)
        now_s = self._clock()
        place = self._place(here, budget_s, now_s)
        return Surroundings(
            at=here,
            when_s=now_s,
            weather=self._weather.read(here, budget_s) if isinstance(self._weather, Remote) else self._weather,
            road=place.road,
            limit=place.limit,
            ahead=place.ahead,
            traffic=self._flow(here, budget_s),
            rules=self._told_rules(now_s),
        )

    async def close(self) -> None:
        """End what is under way, and close the connections."""
        for remote in (self._weather, self._map, self._traffic):
            if isinstance(remote, Remote):
                await remote.close()
        for caller in self._callers:
            await caller.close()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    def _place(self, here: Position, budget_s: float, now_s: float) -> RoadPlace:
        if self._road_map is not None:
            return place_at(self._road_map, here, self._rules, now_s)
        known = self._map.read(here, budget_s) if isinstance(self._map, Remote) else self._map
        if isinstance(known, Unknown):
            return RoadPlace(known, known, known)
        return place_at(known.value, here, self._rules, now_s, known.note)

    def _flow(self, here: Position, budget_s: float) -> ServiceReading[TrafficReport] | Unknown:
        known = self._traffic.read(here, budget_s) if isinstance(self._traffic, Remote) else self._traffic
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

    def _open_weather(self) -> Remote[Weather] | Unknown:
        settings = self._settings
        if "weather" not in settings.online:
            return Unknown(_OFF)
        key = read_key(WEATHER_KEY, settings.weather_url, self._environ)
        if key is None:
            return Unknown(f"there is no key: {WEATHER_KEY} is not set")
        caller = self._caller(settings.weather_url, ("appid", key), WEATHER_KEY, weather.MAX_BYTES)
        return Remote(OpenWeather(caller, settings.weather_decimals), self._clock, self._rng)

    def _tomtom(self) -> Remote[TrafficReport] | Unknown:
        settings = self._settings
        if "traffic" not in settings.online:
            return Unknown(_OFF)
        key = read_key(TRAFFIC_KEY, settings.traffic_url, self._environ)
        if key is None:
            return Unknown(f"there is no key: {TRAFFIC_KEY} is not set")
        caller = self._caller(settings.traffic_url, ("key", key), TRAFFIC_KEY, traffic.MAX_BYTES)
        return Remote(TomTom(caller), self._clock, self._rng)

    def _overpass(self) -> Remote[RoadMap] | Unknown:
        if self._road_map is not None or "map" not in self._settings.online:
            return Unknown("no map is loaded")
        caller = self._caller(self._settings.map_url, None, "", overpass.MAX_BYTES)
        return Remote(Overpass(caller), self._clock, self._rng)

    def _caller(self, url: str, key: tuple[str, str] | None, variable: str, max_bytes: int) -> ServiceCaller:
        made = ServiceCaller(
            url, key=key, key_variable=variable, patience_s=self._settings.patience_s, max_bytes=max_bytes
        )
        self._callers.append(made)
        return made
