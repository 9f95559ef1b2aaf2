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
    _built_in(
        "parking-lift",
        {
            "taken": 0.6,
            "cars": 0,
            "walkers": 1,
            "bays": {"B1": "accessible", "B2": "accessible", "C1": "family", "C2": "family", "E1": "ev", "E2": "ev"},
            "covered": ("A", "B"),
            "free": ("B2", "E2", "C7", "D7", "D5", "A8"),
            "places": {"lift": (24.0, 20.0), "stairs": (0.0, 36.0), "machine": (-4.0, 6.0)},
        },
        11,
        "D5",
        "Park close to the lift, away from other cars.",
        "Parking lot with lift, chargers, accessible and family bays, a roof over two rows",
    ),
)
