"""Built-in scenarios: the three manoeuvres of the paper's Sec. VI-C, and weather that asks for care; open roads."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any, Final

from chauffeur.concept import Scenario
from chauffeur.concept.weather import Weather
from chauffeur.worlds.track.dynamics import Plant
from chauffeur.worlds.track.manoeuvres import ManoeuvreName
from chauffeur.worlds.track.street import Crosswalk, StreetConfig, Thing


def track_scenario(name: ManoeuvreName, weather: Weather, plant: Plant = "std", seed: int = 1) -> Scenario:
    """A manoeuvre in a weather on a plant."""
    config: dict[str, Any] = {"manoeuvre": name, "weather": weather, "plant": plant}
    title = f"{TITLES[name]}; {weather}"
    return Scenario(
        f"track-{name.replace('_', '-')}-{weather}-{plant}", "track", config, seed, {"type": "manoeuvre"}, "", title
    )


TITLES: Final[dict[ManoeuvreName, str]] = {
    "acceleration": "Test track: from a stand to 50 km/h behind a lead vehicle",
    "lane_change": "Test track: lane change at 50 km/h past a lead vehicle",
    "left_turn": "Test track: left turn of radius 23.89 m at 30 km/h",
}


def _built_in(name: str, manoeuvre: ManoeuvreName, weather: Weather, wish: str) -> Scenario:
    made = track_scenario(manoeuvre, weather)
    return Scenario(name, "track", made.config, made.seed, made.goal, wish, made.title)


def street_scenario(name: str, street: StreetConfig, wish: str, title: str, seed: int = 1) -> Scenario:
    """An open road, on the plant of the track."""
    return Scenario(name, "track", {"street": asdict(street)}, seed, {}, wish, title)


BUILT_IN: Final = (
    street_scenario(
        "open-road",
        StreetConfig(
            junction_m=9.0,
            ways=("left", "straight", "right"),
            crosswalks=(Crosswalk(9.0, "left"), Crosswalk(8.0, "straight")),
            things=(Thing("cones", 13.0, "straight"), Thing("vehicle", 11.0, "right")),
        ),
        "Turn left and stop near the crosswalk.",
        "Open road: a junction, crosswalks, cones, a parked car",
    ),
    street_scenario(
        "open-road-straight",
        StreetConfig(crosswalks=(Crosswalk(12.0),), things=(Thing("cones", 32.0),), speed_mps=3.0),
        "Pull over to the right after the crossing.",
        "Open road: a street with a crosswalk and cones, no junction",
    ),
    _built_in("track-acceleration", "acceleration", "sunny", "I am in a hurry, be quick about it."),
    _built_in("track-lane-change", "lane_change", "sunny", "Change lanes, please, nothing special."),
    _built_in("track-left-turn", "left_turn", "snow", "I'm late, but it is slippery."),
    _built_in("track-left-turn-sunny", "left_turn", "sunny", "Careful, there's ice in that bend."),
)
