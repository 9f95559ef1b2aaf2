"""Built-in scenarios: lots chosen by us to show a kind of wish well."""

from __future__ import annotations

from typing import Any

from chauffeur.concept import Scenario


def _built_in(name: str, config: dict[str, Any], seed: int, place: str, wish: str, title: str) -> Scenario:
    return Scenario(name, "parking", config, seed, goal={"type": "park", "place": place}, wish=wish, title=title)


BUILT_IN: tuple[Scenario, ...] = (
    _built_in(
        "parking",
        {},
        5,
        "nearest",
        "Park in the nearest free spot.",
        "Parking lot with three aisles, a car on its way out, somebody on foot",
    ),
    _built_in(
        "parking-stadium",
        {"taken": 0.85, "walkers": 2},
        8,
        "stadium",
        "Park as close to the stadium as you can.",
        "Parking lot, nearly full, people on foot",
    ),
    _built_in(
        "parking-exit",
        {"aisles": 2, "spots_a_row": 10, "cars": 0},
        3,
        "exit",
        "Find a spot close to the exit.",
        "Parking lot with two aisles, nobody drives",
    ),
)
