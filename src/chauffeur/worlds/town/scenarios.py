"""Built-in scenarios: trips through our own towns, chosen to show a kind of wish well."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from chauffeur.concept import ChauffeurError, Scenario
from chauffeur.worlds.town.library import has_pack, load, packs
from chauffeur.worlds.town.pack import Place


def _built_in(name: str, config: dict[str, Any], seed: int, wish: str, title: str) -> Scenario:
    return Scenario(name, "town", config, seed, wish=wish, title=title)


BUILT_IN: tuple[Scenario, ...] = (
    _built_in(
        "town",
        {"town": "Gridford", "vehicles": 35, "people": 30},
        4,
        "Take me to the station.",
        "Gridford, a town with lights: traffic, people on foot, places with names",
    ),
    _built_in(
        "town-church",
        {"town": "Oldbridge", "vehicles": 25, "people": 25},
        6,
        "Take me to the church, please.",
        "Oldbridge, a town with stop signs and lights",
    ),
    _built_in(
        "town-hospital",
        {"town": "Ringstead", "vehicles": 25, "people": 15},
        2,
        "Drive me to the hospital.",
        "Ringstead, a town with a ring road",
    ),
    _built_in(
        "town-street",
        {
            "town": "Gridford",
            "start": ["4:0:-2", 6.0],
            "vehicles": 0,
            "people": 0,
            "stage": [
                {"kind": "bus", "colour": "red", "ahead_m": 14.0, "drives": True, "turns": ["right"]},
                {"kind": "car", "colour": "blue", "ahead_m": 30.0, "left_m": -2.8},
                {"kind": "car", "colour": "silver", "ahead_m": 44.0, "left_m": -2.8},
                {
                    "kind": "pedestrian",
                    "colour": "yellow",
                    "ahead_m": 57.0,
                    "left_m": -3.6,
                    "heading": "left",
                    "speed_mps": 1.3,
                    "for_m": 11.0,
                    "near_m": 34.0,
                },
                {
                    "kind": "truck",
                    "colour": "white",
                    "ahead_m": 60.0,
                    "left_m": 7.0,
                    "heading": "against",
                    "drives": True,
                },
            ],
        },
        7,
        "Park behind the silver car.",
        "A street in Gridford: a bus ahead, cars parked at the kerb, a person who wants to cross",
    ),
)


def in_pack(name: str) -> Scenario | None:
    """A drive through a town by its name, or by the folder of its map pack; None where there is no such town.

    It begins somewhere in the town, as the seed says, among as much traffic as the built-in scenarios have.
    """
    folder = packs().get(name) or Path(name)
    if not has_pack(folder):
        return None
    town = name if name in packs() else str(folder.resolve())
    config = {"town": town, "vehicles": 35, "people": 30}
    return Scenario(name, "town", config, 0, title=f"{folder.name}, a town that was built")


def places_of(scenario: Scenario) -> tuple[Place, ...]:
    """The places of the town that a scenario is set in; none where it names no town, or one that is not here."""
    town = scenario.config.get("town")
    if not isinstance(town, str):
        return ()
    try:
        return load(town).places
    except ChauffeurError:
        return ()
