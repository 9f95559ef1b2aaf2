"""Short drives: what a command comes to on a street, what the planner writes with the model that ships, refusals."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Mapping
from itertools import pairwise

import numpy as np
import pytest

from chauffeur.concept import (
    Context,
    Instruction,
    Limits,
    PlanRequest,
    Situation,
    Street,
    StreetMark,
    StreetWay,
    SystemMessage,
    Trajectory,
)
from chauffeur.planners.vilad import ViladPlanner
from chauffeur.planners.vilad.driving import (
    NOTHING,
    PERIOD_S,
    TEMPLATE,
    WIDTH,
    DriveGoal,
    driving_agreement,
    features,
    fulfils,
    goal,
    reference,
    verified_drive,
    waypoints_of,
)
from chauffeur.planners.vilad.driving_planning import drive_words, trajectory_of
from chauffeur.planners.vilad.unmasking import Decided


def line(length: float) -> tuple[tuple[float, float], ...]:
    return tuple((float(x), 0.0) for x in range(int(length) + 1))


def left_path() -> tuple[tuple[float, float], ...]:
    arc = [(9.0 + 10.5 * math.sin(a), 10.5 * (1.0 - math.cos(a))) for a in np.linspace(0.0, math.pi / 2.0, 20)]
    return (*line(8.0), *arc, *((19.5, 10.5 + y) for y in range(1, 31)))


STREET = Street(
    (
        StreetWay("straight", 55.0, (9.0, 26.5), None, 2.8, line(55.0)),
        StreetWay("left", 55.0, (9.0, 25.5), 10.5, 2.8, left_path()),
    ),
    (
        StreetMark("junction", ("straight",), 9.0, 26.5),
        StreetMark("junction", ("left",), 9.0, 25.5),
        StreetMark("crosswalk", ("left",), 34.5, 37.5),
        StreetMark("cones", ("straight",), 36.0, 39.0),
    ),
    2.0,
)


def asked(**more: str) -> Mapping[str, str]:
    return {**NOTHING, **more}


def stop_of(street: Street = STREET, **more: str) -> float | str:
    found = goal(street, asked(**more))
    return found.stop_m if isinstance(found, DriveGoal) else found


def test_where_a_command_ends() -> None:
    assert stop_of(turn="left", halt="stop", mark="crosswalk", place="before") == pytest.approx(34.5 - 2.25 - 1.5)
    assert stop_of(turn="left", halt="stop", mark="crosswalk", place="after") == pytest.approx(37.5 + 2.25 + 1.5)
    assert stop_of(turn="straight", halt="stop", mark="cones", place="beside") == pytest.approx(37.5)
    assert stop_of(halt="stop", mark="junction", place="before") == pytest.approx(9.0 - 2.25 - 1.5)
    assert stop_of(turn="straight") == pytest.approx(47.0), "nobody said where to stop: to the end of what is known"
    assert stop_of(turn="left", halt="stop", metres="15") == pytest.approx(40.5), "counted from the turn"
    assert stop_of(turn="left", halt="stop", metres="10") == pytest.approx(41.25), "not on the crosswalk"


def test_what_cannot_be_done_is_said() -> None:
    assert stop_of(turn="right") == "there is no way right here"
    assert stop_of(turn="straight", halt="stop", mark="crosswalk", place="before") == "I see no crosswalk on that way"
    assert stop_of(halt="stop", metres="20") == "there is no room to stop there", "not in the junction"
    fast = Street(STREET.ways, STREET.marks, 8.0)
    assert stop_of(fast, halt="stop", mark="junction", place="before") == "there is no room to stop there"
    bare = Street((StreetWay("straight", 55.0),), (), 0.0)
    assert stop_of(bare, halt="kerb") == "there is no kerb to stop at"
    assert reference(STREET, asked(turn="right"))["way"] == 0


def test_the_kerb_is_left_to_who_stands_there() -> None:
    way = StreetWay("straight", 55.0, kerb_m=2.8)
    empty, parked = Street((way,), (), 0.0), Street((way,), (StreetMark("vehicle", ("straight",), 14.0, 18.6),), 0.0)
    assert stop_of(empty, halt="kerb") == pytest.approx(16.0)
    assert stop_of(parked, halt="kerb") == pytest.approx(18.6 + 14.0 + 1.5), "past it, with way to move over"
    assert stop_of(parked, halt="stop") == pytest.approx(16.0), "in the lane beside it"


def test_waypoints_keep_the_pace_slow_down_in_bends_and_end_at_the_goal() -> None:
    for pace, fastest in (("slow", 3.0), ("-", 5.0), ("brisk", 7.0)):
        values = reference(STREET, asked(turn="left", halt="stop", mark="crosswalk", place="before", pace=pace))
        along, aside = waypoints_of(values)
        assert along[-1] == pytest.approx(30.75, abs=0.25)
        assert aside == 0.0
        assert (np.diff(along) >= 0.0).all()
        assert np.diff(along, prepend=0.0).max() / PERIOD_S <= fastest + 0.3
        inside = [b - a for a, b in pairwise(along) if a >= 9.0 and b <= 25.5]
        assert max(inside) / PERIOD_S <= math.sqrt(0.7 * 10.5) + 0.3
        agrees = driving_agreement(STREET, values)
        assert (agrees.pointers, agrees.waypoints) == (True, True)


def test_a_wrong_end_way_or_pace_is_no_success_and_what_disagrees_is_written_again() -> None:
    wish = asked(turn="left", halt="stop", mark="crosswalk", place="before")
    right = reference(STREET, wish)
    assert fulfils(STREET, wish, right)
    straight = reference(STREET, asked(turn="straight", halt="stop", mark="cones", place="before"))
    assert not fulfils(STREET, wish, straight)
    on = asked(turn="straight", halt="stop", mark="cones", place="before")
    assert not fulfils(STREET, on, reference(STREET, {**on, "pace": "slow"}))
    assert not fulfils(STREET, wish, right | {"s10": "41"})
    odd = right | {"s4": "3", "way": 1}
    assert not driving_agreement(STREET, odd).waypoints
    row = TEMPLATE.encode(odd)
    decided = Decided(row, np.zeros(len(row), np.int64), np.ones(len(row)), 3)
    mended = verified_drive(lambda row: np.zeros((len(row), TEMPLATE.size + 7)), STREET, decided)
    values = TEMPLATE.decode(mended.row)
    assert mended.passes == 4
    assert driving_agreement(STREET, values) == driving_agreement(STREET, right)
    assert fulfils(STREET, wish, values)
    kept = verified_drive(lambda row: row, STREET, Decided(TEMPLATE.encode(right), row, np.ones(len(row)), 3))
    assert kept.passes == 3


def test_candidates_are_told_apart() -> None:
    table = features(STREET)
    assert table.shape == (1 + 2 + 4, WIDTH)
    assert np.isfinite(table).all()
    assert len(np.unique(table, axis=0)) == len(table)


def test_a_trajectory_follows_the_way_and_moves_over_to_the_kerb() -> None:
    values = reference(STREET, asked(turn="left", halt="stop", mark="crosswalk", place="before"))
    found = trajectory_of(STREET, values, Limits(), 8.3)
    x, y = found.waypoints_m[-1]
    assert (x, y) == pytest.approx((19.5, 10.5 + 30.75 - 25.5), abs=0.6)
    steps = [math.dist(a, b) for a, b in pairwise(found.waypoints_m)]
    assert steps[-1] == pytest.approx(0.0, abs=0.2)
    assert max(steps) / found.period_s < 6.0
    way = StreetWay("straight", 55.0, kerb_m=2.0, path_m=tuple((x, 0.5) for x, _ in line(55.0)))
    kerb = Street((way,), (), 3.0)
    moved = trajectory_of(kerb, reference(kerb, asked(halt="kerb")), Limits(), 8.3)
    assert moved.waypoints_m[0][1] == pytest.approx(0.0, abs=0.1), "from where the car is"
    assert moved.waypoints_m[-1][1] == pytest.approx(0.5 - 2.0, abs=0.05), "as far over as this kerb is"
    slow = trajectory_of(STREET, values, Limits(max_speed_mps=2.0), 8.3)
    assert max(math.dist(a, b) for a, b in pairwise(slow.waypoints_m)) / slow.period_s <= 2.4


def request(text: str, street: Street | None = STREET) -> PlanRequest:
    context = Context("", Situation("track", 2.0, 8.3, 2, 0, True, None, None), street=street)
    return PlanRequest(Instruction(text), context, SystemMessage(""))


def planned(text: str, street: Street | None = STREET) -> tuple[Trajectory | None, str]:
    plan = asyncio.run(ViladPlanner.from_spec("").plan(request(text, street)))
    assert plan.policy is None or isinstance(plan.policy, Trajectory)
    return plan.policy, plan.thoughts.text


def test_the_model_that_ships_drives_and_refuses() -> None:
    pytest.importorskip("onnxruntime")
    policy, said = planned("Turn left and stop near the crosswalk.")
    assert said == "You want me to turn left and stop before the crosswalk. I stop in the lane after 31 m."
    assert policy is not None
    assert policy.waypoints_m[-1] == pytest.approx((19.5, 15.75), abs=0.7)
    policy, said = planned("Turn right and stop at the crosswalk.")
    assert policy is None
    assert "there is no way right here" in said
    assert planned("Turn left.", None)[0] is None
    assert planned("Reverse fifty metres.")[0] is None
    assert "turn left" in planned("Go right. Sorry, I meant left.")[1]


def test_what_is_understood_is_told() -> None:
    values = reference(STREET, asked(turn="straight", pace="brisk"))
    assert drive_words(STREET, values).startswith("You want me to go straight on, briskly. I drive 47 m;")
