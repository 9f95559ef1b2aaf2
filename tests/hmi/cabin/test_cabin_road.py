"""The road as the cabin page draws it."""

from __future__ import annotations

from chauffeur.concept import Sign
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
    assert told["bars"]["p"] == []


def test_signs_and_streets_come_with_the_road_in_the_frame_of_pictures() -> None:
    lane = RoadLane("a", 3.5, "1", 0, False, ((0.0, 0.0), (50.0, 0.0)), street="Mill Lane")
    signs = (
        Sign("1", "stop", ("a",), 40.0, 0.0),
        Sign("2", "speed_limit", ("a",), 10.0, -4.0, value=50 / 3.6),
        Sign("3", "yield", ("a",), 45.0, -4.0, ((45.0, 2.0), (45.0, -2.0))),
    )
    told = drawn(Road("town", (lane,), signs))
    stop, limit, give_way = told["signs"]
    assert stop["n"] == "STOP" and stop["p"] == [40.0, 4.2], "its post stands to the right of the lane, y downwards"
    assert limit == {"k": "speed_limit", "p": [10.0, 4.0], "line": None, "n": "50"}
    assert give_way["line"] == [45.0, -2.0, 45.0, 2.0]
    assert [(name["n"], name["x"]) for name in told["names"]] == [("Mill Lane", 25.0)]
