"""The weather that trips are told apart by, from the facts of a situation and from the words of a context."""

from __future__ import annotations

from dataclasses import replace

import pytest
from memory_trips import context, trip

from chauffeur.concept import Instruction, PersonId, Situation
from chauffeur.describe.services.readings import ServiceReading, Unknown
from chauffeur.describe.services.sourced import with_sources
from chauffeur.describe.services.surroundings import Surroundings
from chauffeur.describe.services.weather import Weather
from chauffeur.language.weather import DRY, FOG, RAIN, SNOW, UNKNOWN, weather_in, weather_of
from chauffeur.memory import VaultMemory


@pytest.mark.parametrize(
    ("words", "bits"),
    [
        ("rain", RAIN), ("light rain, rain 1.2 mm/h, 12 °C, visibility 4.0 km, daylight", RAIN),
        ("thunderstorm with heavy drizzle", RAIN), ("light snow showers", SNOW), ("sleet", RAIN | SNOW),
        ("freezing rain, mist", RAIN | SNOW | FOG), ("haze", FOG), ("icy", SNOW), ("clear sky, 20 °C", DRY),
        ("scattered clouds", DRY), ("overcast, wind 12 m/s with gusts of 20 m/s", DRY), ("nice, daylight", DRY),
        ("", UNKNOWN), ("not known (the service has nothing for this place)", UNKNOWN),
    ],
)  # fmt: skip
def test_kinds(words: str, bits: int) -> None:
    situation = replace(context().situation, scene=(("road", "rain street"), ("weather", words)))
    assert weather_of(situation) == bits
    if words:
        assert weather_in(f"I am driving. Weather 20 min old: {words}. Road: primary rain street, 2 lanes.") == bits


def test_where_nobody_told_the_weather_it_is_unknown() -> None:
    assert weather_of(context().situation) == UNKNOWN
    assert weather_in("I am driving at 30.0 m/s. It rains.") == UNKNOWN


@pytest.mark.parametrize(
    ("weather", "bits"),
    [
        (ServiceReading(Weather(("light rain", "mist"), 7.5, 4000.0), "", "OpenWeather", 1.0, 1.0), RAIN | FOG),
        (ServiceReading(Weather(("clear sky",), 7.5), "", "OpenWeather", 900.0, 0.5, note="no answer"), DRY),
        (Unknown("offline"), UNKNOWN),
    ],
)
def test_what_the_services_say_is_understood(weather: ServiceReading[Weather] | Unknown, bits: int) -> None:
    no = Unknown("offline")
    there = with_sources(context(), Surroundings(None, 0.0, weather, no, no, no, no, no))  # type: ignore[arg-type]
    assert weather_of(there.situation) == bits
    assert weather_in(there.text) == bits


def there(words: str) -> Situation:
    return replace(context().situation, scene=(("weather", words),))


def test_trips_in_the_rain_come_first_in_the_rain(vault: VaultMemory) -> None:
    for number, words in enumerate(["light rain", "clear sky", "overcast"]):
        one = trip("Ann", "drive faster", id=str(number))
        vault.remember(replace(one, context=replace(one.context, situation=there(words))))
    for _ in ("as it was written", "as it is read from the file"):
        now = replace(context(), situation=there("heavy rain"))
        items = vault.recall(PersonId("Ann"), Instruction("drive faster"), now, 3).items
        assert [item.trip_id for item in items] == ["0", "2", "1"]
        vault.close()
