"""Where a wish asks to be taken to."""

from __future__ import annotations

import pytest

from chauffeur.planners.talk2drive.style import destination_of


@pytest.mark.parametrize(
    ("wish", "place"),
    [
        ("Take me to the station.", "station"),
        ("Could you drive us to St. Mary's Church, please?", "St. Mary's Church"),
        ("Bring me to my hotel now", "hotel"),
        ("Drop me at the bakery and wait", "bakery"),
        ("Take me to the church but don't drive fast", "church"),
        ("Please take me home", "home"),
        ("No, to the bakery, please", "bakery"),
        ("To the left lane", ""),
        ("Let's go home now", "home"),
        ("Don't take me home", ""),
        ("Drive to the left", ""),
        ("Slow down a little", ""),
    ],
)
def test_destination(wish: str, place: str) -> None:
    assert destination_of(wish) == place


@pytest.mark.parametrize(
    ("wish", "place"),
    [
        ("Don't take me to the station.", ""),
        ("I don't want to go to the station", ""),
        ("Take me anywhere but to the station", ""),
        ("Don't take me to the station, take me to the bakery", "bakery"),
        ("Don't stop, take me to the station", "station"),
        ("Why don't you take me to the station?", "station"),
    ],
)
def test_nobody_is_taken_where_they_said_not_to_go(wish: str, place: str) -> None:
    assert destination_of(wish) == place
