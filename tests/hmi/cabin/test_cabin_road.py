"""The road as the cabin page draws it."""

from __future__ import annotations

from chauffeur.driving.talk.messages import Road, RoadLane
from chauffeur.hmi.cabin.board import drawn


def test_pavements_are_no_lanes() -> None:
    way = ((0.0, 0.0), (50.0, 0.0))
    told = drawn(
        Road(
            "town",
            (
                RoadLane("a", 3.5, "1", 0, False, way),
                RoadLane("kerb", 2.0, "1", 1, True, ((0.0, -3.0), (50.0, -3.0)), "emergency"),
                RoadLane("walk", 2.0, "1", 2, False, ((0.0, -6.0), (50.0, -6.0)), "sidewalk"),
            ),
        )
    )
    assert [(lane["id"], lane["e"]) for lane in told["lanes"]] == [("a", False), ("kerb", True)]
    assert len(told["surfaces"]) == 2
    assert told["lanes"][0]["p"] == [0.0, 0.0, 50.0, 0.0]
    assert told["bars"] == []
