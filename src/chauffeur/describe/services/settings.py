"""Which services are asked, where they are, and with which key."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

from chauffeur.concept import ConfigError, addresses
from chauffeur.concept.addresses import Address, http_address

Online = Literal["weather", "map", "traffic"]
"""Services that are reached over the network."""

ONLINE: Final[tuple[Online, ...]] = ("weather", "map", "traffic")
WEATHER_URL: Final = "https://api.openweathermap.org"
MAP_URL: Final = "https://overpass-api.de"
TRAFFIC_URL: Final = "https://api.tomtom.com"
BUDGET_S: Final = 0.3
"""How long one description of the place may wait for all services together."""


@dataclass(frozen=True, slots=True)
class ServiceSettings:
    """Which services are asked, and how.

    Attributes:
        online: Services that may be asked over the network. Each learns about where the car is, so none is asked
            unless it is named here.
        weather_url: A server that speaks OpenWeather 2.5.
        map_url: A server that speaks Overpass.
        traffic_url: A server that speaks TomTom's flow segment data.
        patience_s: After this long a request is given up; until then its answer is taken for the next description.
        weather_decimals: Decimals of the position that the weather service is told: 3 are about 100 m.

    Raises:
        ConfigError: An address is not one, or carries a secret; a number is out of range.
    """

    online: frozenset[Online] = frozenset()
    weather_url: str = WEATHER_URL
    map_url: str = MAP_URL
    traffic_url: str = TRAFFIC_URL
    patience_s: float = 8.0
    weather_decimals: int = 3

    def __post_init__(self) -> None:
        unknown = sorted(self.online - set(ONLINE))
        if unknown:
            raise ConfigError(f"There is no online service {unknown[0]!r}.", hint=f"Known: {', '.join(ONLINE)}.")
        for name in ("weather_url", "map_url", "traffic_url"):
            object.__setattr__(self, name, _address(name, getattr(self, name)).url)
        if not 0.0 < self.patience_s <= 60.0:
            raise ConfigError(f"patience_s is {self.patience_s:g}.", hint="Give seconds, above 0 and at most 60.")
        if not 0 <= self.weather_decimals <= 5:
            raise ConfigError(f"weather_decimals is {self.weather_decimals}.", hint="Give 0 to 5.")


def read_key(variable: str, url: str, environ: Mapping[str, str]) -> str | None:
    """The key in an environment variable; None where there is none.

    Raises:
        ConfigError: It cannot be a key, or would cross a public network unencrypted. Its text is never shown.
    """
    found = addresses.read_key(_address("The service's address", url), (variable,), environ)
    return None if found is None else found[0]


def _address(what: str, given: str) -> Address:
    return http_address(given, what, example="http://localhost:8080")
