"""The weather, from a server that speaks OpenWeather 2.5 ("current weather data").

Nothing that the service words itself goes on: its numeric condition codes are put into our own words.
Source of fields and codes: openweathermap.org/current and openweathermap.org/weather-conditions.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from typing import Any, Final, cast

from chauffeur.concept import DataError
from chauffeur.describe.services.http_source import Service, Told
from chauffeur.describe.services.outside import decoded, items, number, part
from chauffeur.describe.services.readings import Position, distance_m

_DECIMALS: Final = 3
"""Of the position that the service is told: about 100 m."""
_CELL_DEG: Final = 0.01
"""About 1 km: one answer for all of it."""
_FAR_M: Final = 15_000.0
"""Weather from farther away is not told."""
_FULL_VISIBILITY_M: Final = 10_000.0
"""The service reports no more than this."""

_CONDITIONS: Final[Mapping[int, str]] = {
    200: "thunderstorm with light rain", 201: "thunderstorm with rain", 202: "thunderstorm with heavy rain",
    210: "light thunderstorm", 211: "thunderstorm", 212: "heavy thunderstorm", 221: "ragged thunderstorm",
    230: "thunderstorm with light drizzle", 231: "thunderstorm with drizzle", 232: "thunderstorm with heavy drizzle",
    300: "light drizzle", 301: "drizzle", 302: "heavy drizzle", 310: "light drizzle and rain",
    311: "drizzle and rain", 312: "heavy drizzle and rain", 313: "showers and drizzle",
    314: "heavy showers and drizzle", 321: "showers of drizzle",
    500: "light rain", 501: "moderate rain", 502: "heavy rain", 503: "very heavy rain", 504: "extreme rain",
    511: "freezing rain", 520: "light showers", 521: "showers", 522: "heavy showers", 531: "ragged showers",
    600: "light snow", 601: "snow", 602: "heavy snow", 611: "sleet", 612: "light showers of sleet",
    613: "showers of sleet", 615: "light rain and snow", 616: "rain and snow", 620: "light snow showers",
    621: "snow showers", 622: "heavy snow showers",
    701: "mist", 711: "smoke", 721: "haze", 731: "whirls of dust", 741: "fog", 751: "sand in the air",
    761: "dust in the air", 762: "volcanic ash in the air", 771: "squalls", 781: "tornado",
    800: "clear sky", 801: "few clouds", 802: "scattered clouds", 803: "broken clouds", 804: "overcast",
}  # fmt: skip
_GROUPS: Final[Mapping[int, str]] = {2: "thunderstorm", 3: "drizzle", 5: "rain", 6: "snow"}


@dataclass(frozen=True, slots=True)
class Weather:
    """The weather at a place; None for what the service did not say.

    Attributes:
        conditions: In our words, most important first, e.g. ("light rain", "mist").
        temperature_c: Air temperature, degrees Celsius.
        visibility_m: Visibility.
        more_visibility: Whether the visibility may be larger than the number.
        rain_mm_per_h: Rain.
        snow_mm_per_h: Snow, as water.
        wind_mps: Mean wind.
        gust_mps: Gusts.
        sunrise_s: Unix time of sunrise of that day; None near the poles.
        sunset_s: Unix time of sunset.
        night_icon: Whether the service drew the condition for the night; None where it did not say.
    """

    conditions: tuple[str, ...]
    temperature_c: float | None = None
    visibility_m: float | None = None
    more_visibility: bool = False
    rain_mm_per_h: float | None = None
    snow_mm_per_h: float | None = None
    wind_mps: float | None = None
    gust_mps: float | None = None
    sunrise_s: float | None = None
    sunset_s: float | None = None
    night_icon: bool | None = None

    def night(self, now_s: float) -> bool | None:
        """Whether the sun is down at a Unix time; None where that is not known."""
        if self.sunrise_s is not None and self.sunset_s is not None and self.sunrise_s < self.sunset_s:
            return not self.sunrise_s <= now_s < self.sunset_s
        return self.night_icon


def read_weather(body: bytes) -> Told[Weather]:
    """The weather in an answer.

    Raises:
        DataError: It is not an answer of that service, or says nothing about the weather.
    """
    answer = decoded(body)
    # Errors come with status 200 as well from some servers; `cod` is a number in answers and a text in errors.
    code = cast("Mapping[str, Any]", answer).get("cod", 200) if isinstance(answer, Mapping) else None
    if str(code) != "200":
        raise DataError("the answer is not one about the weather")
    listed = items(answer, "weather")[:4]
    conditions = tuple(dict.fromkeys(words for one in listed if (words := _condition(number(one, "id", 200, 999)))))
    main, wind, sun = part(answer, "main"), part(answer, "wind"), part(answer, "sys")
    visibility_m = number(answer, "visibility", 0.0, 100_000.0)
    weather = Weather(
        conditions=conditions,
        temperature_c=number(main, "temp", -95.0, 65.0),
        visibility_m=visibility_m,
        more_visibility=visibility_m is not None and visibility_m >= _FULL_VISIBILITY_M,
        rain_mm_per_h=number(part(answer, "rain"), "1h", 0.0, 500.0),
        snow_mm_per_h=number(part(answer, "snow"), "1h", 0.0, 500.0),
        wind_mps=number(wind, "speed", 0.0, 120.0),
        gust_mps=number(wind, "gust", 0.0, 150.0),
        sunrise_s=number(sun, "sunrise", 1.0, 1e11),
        sunset_s=number(sun, "sunset", 1.0, 1e11),
        night_icon=_night_icon(listed),
    )
    if not conditions and weather.temperature_c is None and weather.visibility_m is None:
        raise DataError("the answer says nothing about the weather")
    return Told(weather, number(answer, "dt", 1.0, 1e11))


def _condition(code: float | None) -> str | None:
    if code is None:
        return None
    return _CONDITIONS.get(int(code)) or _GROUPS.get(int(code) // 100)


def _night_icon(listed: list[Any]) -> bool | None:
    icon = cast("Mapping[str, Any]", listed[0]).get("icon") if listed and isinstance(listed[0], Mapping) else None
    return {"n": True, "d": False}.get(icon[-1:]) if isinstance(icon, str) else None


def _query(here: Position) -> dict[str, str]:
    latitude, longitude = here.rounded(_DECIMALS)
    return {"lat": f"{latitude:.{_DECIMALS}f}", "lon": f"{longitude:.{_DECIMALS}f}", "units": "metric"}


def _cell(here: Position) -> Hashable:
    return round(here.latitude_deg / _CELL_DEG), round(here.longitude_deg / _CELL_DEG)


OPEN_WEATHER: Final = Service(
    name="OpenWeather",
    path="/data/2.5/weather",
    query=_query,
    read=lambda body, _: read_weather(body),
    cell=_cell,
    near=lambda _, asked, here: _cell(asked) == _cell(here),
    serves=lambda _, asked, here: distance_m(asked, here) <= _FAR_M,
    max_bytes=64_000,
    fresh_s=600.0,
    usable_s=3_600.0,
    oldest_s=2.0 * 3_600.0,
    keeps=64,
    key=("appid", "OPENWEATHER_API_KEY"),
)
"""A server that speaks OpenWeather 2.5."""
