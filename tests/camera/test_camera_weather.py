"""Conditions: grades and what follows from them."""

from __future__ import annotations

import pytest

from chauffeur.camera import LOOKS, Conditions, look_of
from chauffeur.concept import ConfigError
from chauffeur.concept.weather import WEATHERS


def test_worse_weather_is_seen_through_less_far():
    for weather in ("rain", "fog", "snow"):
        ranges = [Conditions.of(weather, grade).visibility_m for grade in (0.1, 0.4, 0.7, 1.0)]
        assert ranges == sorted(ranges, reverse=True) and ranges[0] < Conditions().visibility_m
    assert Conditions.of("fog", 0.05).visibility_m < 1000.0  # WMO: fog is below 1,000 m
    assert Conditions.of("fog", 1.0).visibility_m < 50.0
    both = Conditions(rain=0.5, fog=0.5)
    assert both.visibility_m < min(Conditions(rain=0.5).visibility_m, Conditions(fog=0.5).visibility_m)


def test_each_of_the_five_is_itself_and_night_goes_with_all():
    for weather in WEATHERS:
        assert Conditions.of(weather, 0.6).weather == weather
    wet = Conditions.of("rain", 0.6, night=1.0)
    assert (wet.weather, wet.night, wet.label) == ("rain", 1.0, "rain 0.6, night 1")
    assert Conditions.of("night", 0.8).lamps and not Conditions().lamps and Conditions.of("fog", 0.5).lamps


def test_what_cannot_be_is_said():
    with pytest.raises(ConfigError, match=r"rain of 1\.5"):
        Conditions(rain=1.5)
    with pytest.raises(ConfigError, match="nan"):
        Conditions(fog=float("nan"))
    with pytest.raises(ConfigError, match="no weather 'hail'"):
        Conditions.of("hail")  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match="no look 'sepia'"):
        look_of("sepia")
    assert set(LOOKS) == {"default", "held_out_a", "held_out_b"}
