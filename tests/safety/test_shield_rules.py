"""What each rule of the shield lets through, up to its last centimetre, on either side, and what it says then."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from chauffeur.concept import Command, Intervention, Lane, LaneId, Observation, VehicleState
from chauffeur.geometry import Polyline
from chauffeur.safety.shield import LAMPILOT_SHIELD, FilterResult, Shield
from chauffeur.safety.shield.frame import ShieldLens, ShieldScene
from chauffeur.safety.shield.gaps import greatest_acceleration, rss_gap_m
from chauffeur.safety.shield.sweep import swept, yaw_rate
from chauffeur.worlds.base import EGO
from roads import a_lane, a_road

DT, LIMIT = 0.1, 30.0
TABLE = LAMPILOT_SHIELD
COAST, GAS, BRAKE = Command(0.0, 0.0), Command(5.0, 0.0), Command(-5.0, 0.0)
OWN: LaneId = "a-b:1"
SIDES = pytest.mark.parametrize("side", [1.0, -1.0], ids=["left", "right"])
Lanes = tuple[Lane, ...]


def road(*centres: float) -> Lanes:
    """Straight lanes along x, 4 m wide; the one at y = 0 is `OWN`."""
    return tuple(a_lane(f"a-b:{1 - round(y / 4.0)}", ((0.0, y), (2000.0, y)), limit=LIMIT) for y in centres)


THREE, ONE = road(-4.0, 0.0, 4.0), road(0.0)


def bend(side: float, radius: float, *centres: float) -> Lanes:
    """The same on circles about (0, side * radius)."""

    def points(y: float) -> tuple[tuple[float, float], ...]:
        steps = (math.radians(n / 2.0) for n in range(-40, 41))
        return tuple(((radius - y) * math.sin(at), side * (radius - (radius - y) * math.cos(at))) for at in steps)

    return tuple(replace(one, centre=Polyline.of(points(side * one.centre.points_m[0][1]))) for one in road(*centres))


def ego(y: float, speed: float, heading: float = 0.0, x: float = 500.0) -> VehicleState:
    return VehicleState(EGO, "car", x, y, heading, speed, 5.0, 2.0, OWN)


def car(number: int, x: float, y: float, speed: float, heading: float = 0.0) -> VehicleState:
    """A car `x` metres ahead of the ego, centre to centre."""
    return VehicleState(number, "car", 500.0 + x, y, heading, speed, 5.0, 2.0, OWN)


def instant(me: VehicleState, *others: VehicleState, lanes: Lanes = THREE) -> Observation:
    return Observation(0.0, 0, "highway", me, others, (), a_road(lanes), None, None, False, False)


def guarded(command: Command, me: VehicleState, *others: VehicleState, lanes: Lanes = THREE) -> FilterResult:
    return Shield(DT).filter(instant(me, *others, lanes=lanes), command)


def passes(command: Command, me: VehicleState, *others: VehicleState, lanes: Lanes = THREE) -> bool:
    return guarded(command, me, *others, lanes=lanes) == FilterResult(command)


def why(command: Command, me: VehicleState, *others: VehicleState, lanes: Lanes = THREE) -> str:
    """The only rule that changed the command, and what it says."""
    (change,) = guarded(command, me, *others, lanes=lanes).interventions
    return f"{change.rule}: {change.reason}"


def looked(me: VehicleState, lanes: Lanes) -> ShieldScene:
    scene = ShieldLens().look(instant(me, lanes=lanes), me.lane)
    assert scene is not None
    return scene


def reaches(steering: float, me: VehicleState, lanes: Lanes = THREE) -> tuple[float, float]:
    """(lowest, highest) place the body of the ego gets to when it is steered and comes back to its own lane."""
    scene = looked(me, lanes)
    size = me.length_m, me.width_m
    return swept(scene.ego, me.speed_mps, size, steering, 0.0, TABLE.steering_rad, DT, scene.curvature)


def last(good: float, bad: float, holds: Callable[[float], bool]) -> float:
    """The last number for which something holds on the way from a good one to a bad one."""
    assert holds(good)
    assert not holds(bad)
    for _ in range(32):
        middle = (good + bad) / 2.0
        good, bad = (middle, bad) if holds(middle) else (good, middle)
    return good


# Across the road: its edges -------------------------------------------------------------------------------------------


@SIDES
def test_the_body_may_reach_five_centimetres_over_the_edge_of_the_road(side: float) -> None:
    me = ego(side * 0.7, 10.0)
    steering = last(0.0, side * 0.5, lambda angle: passes(Command(0.0, angle), me, lanes=ONE))
    low, high = reaches(steering, me, ONE)
    assert max(side * low, side * high) == pytest.approx(2.05, abs=1e-6)
    assert why(Command(0.0, steering + side * 1e-3), me, lanes=ONE) == "lane: That would leave the road."


@SIDES
@pytest.mark.parametrize("outwards", [1.0, -1.0])
def test_beside_a_road_that_bends_there_is_half_a_metre_more(side: float, outwards: float) -> None:
    """Where lanes bend, cars cut corners."""
    lanes = bend(side, 60.0, 0.0)
    me = ego(outwards * 1.3, 8.0, x=0.0)
    steering = last(0.0, outwards * 0.7, lambda angle: passes(Command(0.0, angle), me, lanes=lanes))
    low, high = reaches(steering, me, lanes)
    assert max(outwards * low, outwards * high) == pytest.approx(2.55, abs=1e-2)


@SIDES
def test_who_stands_over_the_edge_already_is_not_told_so(side: float) -> None:
    assert passes(COAST, ego(side * 1.5, 0.0), lanes=ONE)


def test_more_than_one_line_at_once_is_not_crossed() -> None:
    for side in (1.0, -1.0):
        me = ego(side * -0.5, 25.0, side * 0.25)
        assert why(Command(0.0, side * 0.2), me) == "lane: That would cross more than one line at once."


@SIDES
def test_who_stands_across_three_lanes_already_is_let_be(side: float) -> None:
    assert passes(COAST, ego(0.0, 0.0, side * math.pi / 2.0))


# Across the road: how sharply -----------------------------------------------------------------------------------------


@SIDES
def test_to_the_side_it_gets_no_faster_than_any_lane_change_needs(side: float) -> None:
    me = ego(0.0, 25.0, side * 0.2)
    steering = last(0.0, side * 0.4, lambda angle: passes(Command(0.0, angle), me))
    turned = side * 0.2 + yaw_rate(25.0, steering) * DT
    assert abs(25.0 * math.sin(turned)) == pytest.approx(TABLE.sideways_mps, abs=1e-6)
    assert why(Command(0.0, steering + side * 1e-3), me) == "lane: That is too sharp at this speed."


@SIDES
def test_who_is_turned_too_far_already_may_go_on_straight_but_turn_no_further(side: float) -> None:
    me = ego(side * -1.5, 25.0, side * 0.33)
    assert passes(COAST, me)
    assert why(Command(0.0, side * 1e-3), me) == "lane: That is too sharp at this speed."


@SIDES
def test_with_one_lane_only_a_slow_car_turns_no_further_than_it_needs(side: float) -> None:
    def steep(speed: float, lanes: Lanes) -> bool:
        slow = ego(0.0, speed, side * 0.14)
        return not passes(Command(0.0, side * 0.6), slow, lanes=lanes)

    me = ego(0.0, 2.9, side * 0.14)
    steering = last(0.0, side * 0.6, lambda angle: passes(Command(0.0, angle), me, lanes=ONE))
    assert abs(side * 0.14 + yaw_rate(2.9, steering) * DT) == pytest.approx(0.15, abs=1e-6)
    assert steep(2.9, ONE)
    assert not steep(3.0, ONE), "from 3 m/s on a car is not slow"
    assert not steep(2.9, road(0.0, 4.0)), "there is a lane to turn to"
    assert not steep(2.9, THREE)


@SIDES
def test_where_a_road_bends_a_car_is_turned_against_it_by_going_straight_on(side: float) -> None:
    lanes = bend(side, 20.0, 0.0)
    me = ego(0.0, 2.9, side * -0.14, x=0.0)
    assert why(COAST, me, lanes=lanes) == "lane: That is too sharp at this speed."
    along = last(side * 0.3, 0.0, lambda angle: passes(Command(0.0, angle), me, lanes=lanes))
    scene = looked(me, lanes)
    turned = scene.ego.heading_rad + (yaw_rate(2.9, along) - scene.curvature * 2.9) * DT
    assert abs(turned) == pytest.approx(0.15, abs=1e-6)


# Across the road: lanes of others -------------------------------------------------------------------------------------


@SIDES
def test_a_lane_is_entered_five_centimetres_beyond_its_line(side: float) -> None:
    me, beside = ego(side * 0.7, 10.0), car(1, 0.0, side * 4.0, 10.0)
    assert passes(Command(0.0, side * 0.5), me), "with nobody there it may"
    steering = last(0.0, side * 0.5, lambda angle: passes(Command(0.0, angle), me, beside))
    low, high = reaches(steering, me)
    assert max(side * low, side * high) == pytest.approx(2.05, abs=1e-6)
    text = why(Command(0.0, steering + side * 1e-3), me, beside)
    assert text == "lane: The lane is not free: a car is beside."


@SIDES
def test_the_lane_on_the_far_side_need_not_be_free(side: float) -> None:
    me, turn = ego(0.0, 20.0, side * 0.25), Command(0.0, side * 0.2)
    assert not passes(turn, me, car(1, 0.0, side * 4.0, 20.0))
    assert passes(turn, me, car(1, 0.0, side * -4.0, 20.0))
    assert passes(turn, me)


@SIDES
def test_a_car_beside_a_lane_is_not_in_it(side: float) -> None:
    me, turn = ego(side * 0.5, 20.0, side * 0.1), Command(0.0, side * 0.1)
    five = road(-8.0, -4.0, 0.0, 4.0, 8.0)
    assert passes(turn, me, car(1, 0.0, side * 7.5, 20.0), lanes=five)
    assert not passes(turn, me, car(1, 0.0, side * 6.9, 20.0), lanes=five)


@SIDES
def test_who_is_over_a_line_already_is_not_turned_out_while_it_gets_no_further(side: float) -> None:
    assert passes(COAST, ego(side * 1.5, 0.0), car(1, 0.0, side * 4.0, 0.0))


@SIDES
@pytest.mark.parametrize("speed", [30.0, 34.0])
@pytest.mark.parametrize(("y", "response_s"), [(0.5, TABLE.others_response_s), (1.4, 0.0)])
def test_a_car_behind_in_a_lane_needs_its_distance(side: float, speed: float, y: float, response_s: float) -> None:
    """Once the body is over the line the other has seen it, and needs no time to respond any more."""
    me, turn = ego(side * y, 25.0, side * 0.05), Command(0.0, side * 0.25)
    along, half_m = 25.0 * math.cos(0.05), 2.5 * math.cos(0.05) + math.sin(0.05)
    needed = TABLE.margin_m + rss_gap_m(
        speed, along, response_s, TABLE.others_acceleration_mps2, TABLE.others_sure_braking_mps2, TABLE.gentle_mps2
    )
    shortest = last(200.0, 0.0, lambda gap: passes(turn, me, car(1, -half_m - 2.5 - gap, side * 4.0, speed)))
    assert shortest == pytest.approx(needed, abs=1e-6)
    nearer = needed - 3.0
    assert why(turn, me, car(1, -half_m - 2.5 - nearer, side * 4.0, speed)) == (
        f"lane: The lane is not free: a car {nearer:.0f} m behind in it needs {needed:.0f} m."
    )


@SIDES
@pytest.mark.parametrize("speed", [5.0, 15.0, 20.0])
def test_a_car_ahead_in_a_lane_must_not_have_to_be_braked_hard_for(side: float, speed: float) -> None:
    me, turn = ego(side * 0.5, 25.0, side * 0.05), Command(-3.0, side * 0.25)
    along, half_m = 25.0 * math.cos(0.05), 2.5 * math.cos(0.05) + math.sin(0.05)

    def turned(gap: float) -> bool:
        found = guarded(turn, me, car(1, half_m + 2.5 + gap, side * 4.0, speed))
        return found.command.steering_rad == turn.steering_rad

    shortest = last(200.0, 0.0, turned)
    braking = greatest_acceleration(
        along, shortest - TABLE.margin_m, speed, TABLE.braking_mps2, TABLE.others_braking_mps2, DT
    )
    assert braking == pytest.approx(-TABLE.gentle_mps2, abs=1e-6)
    nearer = shortest - 1.0
    found = guarded(turn, me, car(1, half_m + 2.5 + nearer, side * 4.0, speed))
    assert found.interventions[0].reason == f"The lane is not free: a car {nearer:.0f} m ahead in it is too close."


def test_a_slow_car_may_turn_out_close_behind_one_that_stands() -> None:
    me = ego(1.0, 0.4, 0.3)
    half_m = 2.5 * math.cos(0.3) + math.sin(0.3)
    stands = car(1, half_m + 2.5 + 1.6, 4.0, 0.0)
    assert guarded(Command(0.0, 0.2), me, stands).command.steering_rad == 0.2
    nearer = car(1, half_m + 2.5 + 1.4, 4.0, 0.0)
    assert guarded(Command(0.0, 0.2), me, nearer).interventions[0].reason == "The lane is not free: a car is beside."


# Across the road: the way back ----------------------------------------------------------------------------------------


@SIDES
def test_the_lane_that_was_promised_is_the_way_back_beyond_its_line(side: float) -> None:
    """Just over the line a car is nearest to the next lane; what it can come back to is still the one before."""
    over, wild = ego(side * 2.4, 30.0, side * -0.02), Command(0.0, side * -0.62)
    assert side * guarded(wild, over).command.steering_rad > 0.0, "on to the nearest, with none promised"
    shield = Shield(DT)
    assert shield.filter(instant(ego(side * 1.9, 30.0)), COAST) == FilterResult(COAST)
    for _ in range(3):
        refused = shield.filter(instant(over), wild)
        assert side * refused.command.steering_rad < 0.0, "and a refused command takes no promise away"


@SIDES
def test_a_command_may_lead_back_to_the_lane_that_was_promised(side: float) -> None:
    """Turned out sharply, the car needs more room to come to rest in the next lane than to turn back."""
    lanes = road(0.0, side * 4.0, side * 8.0)
    over, turn = ego(side * 2.58, 25.0, side * 0.68), Command(0.0, side * -0.31)
    assert why(turn, over, lanes=lanes) == "lane: That would cross more than one line at once."
    shield = Shield(DT)
    assert shield.filter(instant(ego(side * 1.9, 25.0), lanes=lanes), COAST) == FilterResult(COAST)
    assert shield.filter(instant(over, lanes=lanes), turn) == FilterResult(turn)


@SIDES
def test_the_lane_a_car_is_nearest_to_counts_as_its_own(side: float) -> None:
    found = guarded(Command(0.0, side * TABLE.steering_rad), ego(side * 3.5, 25.0))
    assert side * found.command.steering_rad == pytest.approx(0.033, abs=1e-3), "to the middle of that lane"


@SIDES
def test_what_is_steered_already_as_it_would_be_is_no_change(side: float) -> None:
    """A car on its way off the road, that nothing can keep on it any more."""
    me = ego(side * 1.8, 20.0, side * 0.8)
    wrong = Command(0.0, side * 0.3)
    found = guarded(wrong, me, lanes=ONE)
    assert found.interventions == (Intervention("lane", "That would leave the road.", wrong, found.command),)
    assert passes(found.command, me, lanes=ONE)
    opposite = Command(0.0, -found.command.steering_rad)
    assert guarded(opposite, me, lanes=ONE).interventions[0].before == opposite


@SIDES
def test_where_a_road_bends_it_is_steered_back_along_the_bend(side: float) -> None:
    lanes = bend(side, 60.0, 0.0)
    me = ego(0.0, 25.0, x=0.0)
    scene = looked(me, lanes)
    turned = scene.curvature * 25.0 * 0.1 - scene.ego.heading_rad
    for wrong in (Command(math.nan, 0.0), Command(0.0, side * 0.7)):
        bent = guarded(wrong, me, lanes=lanes).command.steering_rad
        more = yaw_rate(25.0, bent) - yaw_rate(25.0, guarded(wrong, me, lanes=ONE).command.steering_rad)
        assert more == pytest.approx(5.0 * turned, abs=1e-2), "lane keeping looks 0.1 s ahead"


# Along the road -------------------------------------------------------------------------------------------------------


def test_each_rule_says_what_it_asks_for() -> None:
    fast = ego(0.0, LIMIT + 0.9)
    assert why(GAS, fast) == "speed: No faster than 31 m/s (112 km/h) here."
    assert why(BRAKE, ego(0.0, 0.2)) == "reverse: The car stands; it does not reverse."
    assert why(BRAKE, ego(0.0, 25.0), car(1, -11.0, 0.0, 26.0)) == (
        "brake: A car close behind could not stop for braking that hard, and nothing ahead asks for it."
    )
    assert why(COAST, ego(0.0, 25.0), car(1, 25.0, 0.0, 0.0)) == (
        "gap: Too close to the car 20 m ahead to ask for more."
    )
    assert why(COAST, ego(0.0, 25.0), car(1, 5.3, 0.0, 0.0)) == "gap: Too close to the car 0 m ahead to ask for more."


def test_what_is_no_number_is_told_of_with_what_took_its_place() -> None:
    stop = Command(-TABLE.braking_mps2, 0.0)
    wrong = Command(math.inf, 0.0)
    said = Intervention("finite", "A command that is no number was replaced.", wrong, stop)
    assert guarded(wrong, ego(0.0, 25.0)) == FilterResult(stop, (said,))
    said = Intervention("finite", "Where somebody is cannot be told.", COAST, stop)
    assert guarded(COAST, ego(0.0, 25.0), car(1, math.nan, 0.0, 0.0)) == FilterResult(stop, (said,))


@pytest.mark.parametrize("asked", [-5.0, -0.5])
def test_a_car_that_stands_and_is_braked_stands_without_a_word(asked: float) -> None:
    assert guarded(Command(asked, 0.0), ego(0.0, 0.0)) == FilterResult(COAST)


def test_a_turned_wheel_alone_is_nothing_to_be_told_of() -> None:
    assert passes(Command(-2.0, 0.01), ego(0.0, 25.0))


def test_the_whole_speed_counts_however_the_car_is_turned() -> None:
    found = guarded(Command(5.0, -0.05), ego(0.0, LIMIT + 0.9, 0.2))
    assert found.command.acceleration_mps2 == pytest.approx(1.0)


@pytest.mark.parametrize("over", [0.95, 1.0, 1.02, 1.09, 1.2, 9.0])
def test_above_the_limit_it_slows_gently(over: float) -> None:
    found = guarded(GAS, ego(0.0, LIMIT + over))
    assert found.command.acceleration_mps2 == pytest.approx(max(-1.0, (1.0 - over) / DT))


def test_the_limit_of_the_lane_it_is_in_counts_while_it_steers_for_another() -> None:
    slower = tuple(replace(lane, speed_limit_mps=20.0) if lane.id != OWN else lane for lane in THREE)
    observation = instant(ego(0.0, 25.0), lanes=slower)
    for aim in (None, "a-b:2", "a-b:0"):
        assert Shield(DT).filter(observation, COAST, aim) == FilterResult(COAST)


@pytest.mark.parametrize(("speed", "lead"), [(0.0, 0.0), (0.5, 0.0), (5.0, 0.0), (20.0, 0.0), (20.0, 10.0)])
def test_gas_is_cut_wherever_a_lead_asks_for_it(speed: float, lead: float) -> None:
    cut = 0
    for tenth in range(1, 2000):
        gap = TABLE.margin_m + tenth / 10.0 - 0.05
        wanted = greatest_acceleration(
            speed, gap - TABLE.margin_m, lead, TABLE.braking_mps2, TABLE.others_braking_mps2, DT
        )
        wanted = max(wanted, -speed / DT)
        found = guarded(GAS, ego(0.0, speed), car(1, gap + 5.0, 0.0, lead)).command.acceleration_mps2
        assert found == pytest.approx(min(wanted, 5.0), abs=1e-9)
        cut += wanted < 5.0
        if wanted > 10.0:
            break
    assert cut


def test_a_car_that_stands_across_the_lane_is_a_lead_too() -> None:
    stands = car(1, 30.0, 0.0, 0.0, math.pi / 2.0)
    found = guarded(COAST, ego(0.0, 25.0), stands)
    assert [change.rule for change in found.interventions] == ["gap"]


def test_who_is_behind_is_no_lead_and_who_is_ahead_no_follower() -> None:
    assert passes(GAS, ego(0.0, 25.0), car(1, -6.0, 0.0, 0.0))
    assert passes(BRAKE, ego(0.0, 25.0), car(1, 12.0, 0.0, 28.0))


@SIDES
def test_who_is_over_a_line_minds_those_in_both_lanes_wherever_they_are_in_them(side: float) -> None:
    """The body ends at 0.5 m and 2.5 m, the others' at -0.5 m and 5.5 m."""
    me = ego(side * 1.5, 20.0)
    for y in (-1.5, 6.4):
        found = guarded(COAST, me, car(1, 20.0, side * y, 0.0), lanes=road(-8.0, -4.0, 0.0, 4.0, 8.0))
        assert "gap" in [change.rule for change in found.interventions], y


@SIDES
def test_who_hangs_over_the_edge_of_the_road_minds_what_stands_there(side: float) -> None:
    me, post = ego(side * 1.5, 10.0), replace(car(1, 12.0, side * 3.4, 0.0), kind="obstacle")
    found = guarded(Command(0.0, side * -0.05), me, post, lanes=ONE)
    assert "gap" in [change.rule for change in found.interventions]


@pytest.mark.parametrize("speed", [22.0, 26.0, 31.0])
@pytest.mark.parametrize("asked", [-4.0, -5.0, -7.0])
def test_braking_is_softened_exactly_for_who_could_not_answer_it(asked: float, speed: float) -> None:
    needed = TABLE.margin_m + rss_gap_m(
        speed, 25.0, TABLE.others_response_s, 0.0, TABLE.others_sure_braking_mps2, -asked
    )
    hard = Command(asked, 0.0)
    shortest = last(200.0, 0.0, lambda gap: passes(hard, ego(0.0, 25.0), car(1, -5.0 - gap, 0.0, speed)))
    assert shortest == pytest.approx(needed, abs=1e-6)
    soft = guarded(hard, ego(0.0, 25.0), car(1, -5.0 - shortest + 0.1, 0.0, speed))
    assert soft.command.acceleration_mps2 == -TABLE.gentle_mps2


@SIDES
def test_who_follows_beside_the_lane_is_no_follower(side: float) -> None:
    assert passes(BRAKE, ego(0.0, 25.0), car(1, -8.0, side * 3.5, 26.0))
    assert not passes(BRAKE, ego(0.0, 25.0), car(1, -8.0, side * 2.9, 26.0))
