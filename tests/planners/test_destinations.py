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
        ("Drive to the left", ""),
        ("Slow down a little", ""),
    ],
)
def test_destination(wish: str, place: str) -> None:
    assert destination_of(wish) == place
