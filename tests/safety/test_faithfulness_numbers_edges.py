"""Numbers of a program, each by what it measures: which way they go, what a text may say of them, how they are told."""

from __future__ import annotations

import pytest
from faithfulness_programs import HIGHWAY

from chauffeur.concept.units import M_PER_CAR_LENGTH
from chauffeur.language.quantities import Quantity
from chauffeur.safety.faithfulness import Facts, FactSurroundings, judge, read_facts
from chauffeur.safety.faithfulness.facts import Deed, Event, FactMark
from chauffeur.safety.faithfulness.numbers import Numbers
from chauffeur.safety.faithfulness.values import Base, Term

NOWHERE = FactSurroundings()


def plain(value: float, *, bound: bool = False) -> Term:
    return Term("", 0.0, value, bound)


def count(base: Base, factor: float = 1.0, offset: float = 0.0) -> Term:
    return Term(base, factor, offset)


def event(deed: Deed, *terms: Term, unsure: bool = False) -> Event:
    return Event(deed, 3, frozenset(terms), open=unsure)


def speed(*terms: Term, unsure: bool = False) -> Event:
    return event("speed", *terms, unsure=unsure)


def mark(base: Base, value: float, *, compared: bool = True) -> FactMark:
    return FactMark(base, value, 4, compared)


def numbers(*found: Event | FactMark, where: FactSurroundings = HIGHWAY, literals: tuple[float, ...] = ()) -> Numbers:
    events = tuple(one for one in found if isinstance(one, Event))
    marks = tuple(one for one in found if isinstance(one, FactMark))
    return Numbers(Facts(events, marks, literals=frozenset(literals)), where)


def mps(value: float) -> Quantity:
    return Quantity(value, "speed", "")


def metres(value: float) -> Quantity:
    return Quantity(value, "distance", "")


def seconds(value: float) -> Quantity:
    return Quantity(value, "time", "")


def share(value: float) -> Quantity:
    return Quantity(value, "share", "")


# Which way --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("speeds", "signs"),
    [
        ([speed(plain(25.0))], {0}),
        ([speed(plain(25.5))], {1}),
        ([speed(plain(24.5))], {-1}),
        ([speed(count("ego", 1.0, 0.4))], {1}),
        ([speed(count("ego", 1.0, -0.4))], {-1}),
        ([speed(count("ego", 1.0, 0.39))], {0}),
        # A plain speed that only bounds another is not what is wanted, unless there is nothing else.
        ([speed(plain(20.0, bound=True), count("ego"))], {0}),
        ([speed(plain(20.0, bound=True), plain(30.0))], {1}),
        ([speed(plain(20.0, bound=True))], {-1}),
        ([speed(plain(20.0, bound=True), unsure=True)], set[int]()),
        # A slower vehicle ahead is followed for the time being.
        ([speed(count("other"), count("ego", 1.0, 3.0))], {1}),
        ([speed(count("other"))], {-1}),
        # A speed of its own outweighs one that counts from the present one.
        ([speed(plain(20.0), count("ego", 1.0, 3.0))], {-1}),
        ([speed(count("limit"), count("ego", 1.0, -3.0))], {1}),
        ([speed(plain(20.0)), speed(plain(30.0))], {-1, 1}),
    ],
)
def test_which_way_the_speed_goes(speeds: list[Event], signs: set[int]) -> None:
    assert numbers(*speeds).signs() == signs


@pytest.mark.parametrize(("factor", "sign"), [(1.2, 1), (1.0, 0), (0.8, -1), (1.02, 1)])
def test_a_share_of_an_unknown_speed_is_more_or_less_all_the_same(factor: float, sign: int) -> None:
    assert numbers(speed(count("ego", factor)), where=NOWHERE).signs() == {sign}


@pytest.mark.parametrize(
    ("found", "where", "signs"),
    [
        ([event("gap", count("gap", 1.0, 5.0))], NOWHERE, {1}),
        ([event("gap", count("gap", 1.0, -5.0))], NOWHERE, {-1}),
        ([event("gap", count("gap", 1.0, 0.5))], NOWHERE, {1}),
        ([event("gap", count("gap"))], NOWHERE, {0}),
        ([event("gap", count("gap", 1.5))], NOWHERE, {1}),
        ([event("gap", count("gap", 0.5))], NOWHERE, {-1}),
        ([event("gap", plain(40.5))], HIGHWAY, {1}),
        ([event("gap", plain(40.4))], HIGHWAY, {0}),
        ([event("gap", plain(39.5))], HIGHWAY, {-1}),
        ([event("headway", count("per speed", 1.0, 30.0))], HIGHWAY, {-1}),
        ([event("headway", count("per speed", 1.0, 41.0))], HIGHWAY, {1}),
        ([event("headway", count("headway", 1.5))], HIGHWAY, {1}),
        ([event("headway", count("headway", 1.0, -0.5))], HIGHWAY, {-1}),
        ([mark("gap", 41.0)], HIGHWAY, {1}),
        ([mark("gap", 39.0)], HIGHWAY, {-1}),
    ],
)
def test_which_way_the_gap_goes(found: list[Event | FactMark], where: FactSurroundings, signs: set[int]) -> None:
    assert numbers(*found, where=where).gap_signs() == signs


# What a text may say ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("found", "where", "said", "loosely", "exactly"),
    [
        # Steps and differences are numbers of the program, but not where the speed gets.
        ([speed(count("ego", 1.0, 5.0))], HIGHWAY, 30.0, True, True),
        ([speed(count("ego", 1.0, 5.0))], HIGHWAY, 5.0, True, False),
        ([speed(count("ego", 1.0, 3.0))], NOWHERE, 3.0, True, False),
        ([speed(plain(30.0))], HIGHWAY, 5.0, True, False),
        ([speed(plain(30.0))], HIGHWAY, 1.0, True, False),
        ([speed(plain(30.0))], HIGHWAY, 2.0, False, False),
        ([speed(count("limit", 1.0, -2.0))], HIGHWAY, 29.0, True, True),
        ([speed(count("limit", 1.0, -2.0))], HIGHWAY, 31.0, True, True),
        ([speed(count("limit"))], NOWHERE, 1.0, False, False),
        # Another's speed is one of its own only where it goes by nothing else.
        ([speed(count("other"))], HIGHWAY, 22.0, True, True),
        ([speed(count("other"), plain(30.0))], HIGHWAY, 22.0, True, False),
        ([speed(count("other", 1.0, 2.0), plain(30.0))], HIGHWAY, 24.0, False, False),
        # What the own speed is compared with may be where it is to get, if nothing else tells that.
        ([speed(count("ego", 1.0, 3.0)), mark("ego", 12.0)], HIGHWAY, 12.0, True, True),
        ([speed(count("ego", 1.0, 3.0)), mark("ego", 12.0, compared=False)], HIGHWAY, 12.0, True, False),
        ([speed(plain(30.0)), mark("ego", 12.0)], HIGHWAY, 12.0, True, False),
        ([speed(count("ego", 1.0, 3.0)), mark("gap", 12.0)], HIGHWAY, 12.0, False, False),
        ([speed(plain(30.0)), mark("other", 12.0)], HIGHWAY, 12.0, True, False),
    ],
)
def test_speeds_that_a_text_may_say(
    found: list[Event | FactMark], where: FactSurroundings, said: float, loosely: bool, exactly: bool
) -> None:
    known = numbers(*found, where=where)
    assert known.supports(mps(said)) is loosely
    assert known.supports(mps(said), exact=True) is exactly


@pytest.mark.parametrize(
    ("found", "held"),
    [
        ([speed(unsure=True)], True),
        ([speed(plain(20.0), unsure=True)], False),
        ([speed(plain(20.0), unsure=True), event("turn")], True),
        ([speed(plain(20.0)), event("turn")], False),
        ([event("turn")], False),
    ],
)
def test_a_number_that_is_only_written_counts_where_the_speed_is_not_known(found: list[Event], held: bool) -> None:
    assert numbers(*found, literals=(8.0,)).supports(mps(8.0)) is held


STEERS = event("gap", plain(25.0))


@pytest.mark.parametrize(
    ("found", "where", "said", "held"),
    [
        ([mark("gap", 60.0)], HIGHWAY, 60.0, True),
        ([mark("gap", 60.0), STEERS], HIGHWAY, 60.0, False),
        ([mark("past", 60.0), STEERS], HIGHWAY, 60.0, True),
        ([mark("behind", 60.0), STEERS], HIGHWAY, 60.0, True),
        ([mark("sign", 60.0), STEERS], HIGHWAY, 60.0, True),
        ([mark("ego", 60.0)], HIGHWAY, 60.0, False),
        ([mark("gap", 0.0)], NOWHERE, 0.3, True),
        ([mark("gap", 0.0)], NOWHERE, 0.31, False),
        ([event("gap", count("gap", 1.0, 5.0))], HIGHWAY, 45.0, True),
        ([event("gap", count("gap", 1.0, 5.0))], HIGHWAY, 35.0, False),
        ([event("gap", count("gap", 1.0, 5.0))], HIGHWAY, 5.0, True),
        ([event("gap", count("gap", 1.0, 5.0))], NOWHERE, 5.0, True),
        ([event("gap", count("ego", 2.0))], NOWHERE, 50.0, False),
        ([event("gap", count("ego", 2.0))], HIGHWAY, 50.0, True),
        ([event("headway", plain(2.0))], HIGHWAY, 50.0 + M_PER_CAR_LENGTH, True),
        ([event("headway", plain(2.0))], HIGHWAY, 50.0 - M_PER_CAR_LENGTH, False),
    ],
)
def test_distances_that_a_text_may_say(
    found: list[Event | FactMark], where: FactSurroundings, said: float, held: bool
) -> None:
    assert numbers(*found, where=where).supports(metres(said)) is held


@pytest.mark.parametrize(
    ("found", "where", "said", "held"),
    [
        ([], NOWHERE, 0.1, True),  # the control period
        ([], NOWHERE, 1.1, False),
        ([event("wait", plain(4.0))], HIGHWAY, 4.0, True),
        ([event("headway", plain(4.0))], HIGHWAY, 4.0, True),
        ([event("headway", plain(5.0))], HIGHWAY, 0.2, False),
        ([event("headway", count("per speed", 1.0, 60.0))], HIGHWAY, 2.4, True),
        ([event("headway", count("per speed", 1.0, 60.0))], NOWHERE, 2.4, False),
        ([speed(plain(20.0))], HIGHWAY, 20.0, False),
        ([speed(plain(20.0))], HIGHWAY, 0.8, False),
    ],
)
def test_times_that_a_text_may_say(found: list[Event], where: FactSurroundings, said: float, held: bool) -> None:
    assert numbers(*found, where=where).supports(seconds(said)) is held


@pytest.mark.parametrize(
    ("factors", "said", "held"),
    [
        ((1.0,), 0.5, True),  # it is no share that the program goes by
        ((), 0.5, True),
        ((0.8,), 0.8, True),
        ((0.8,), 0.2, True),
        ((0.8,), 1.25, True),
        ((0.8,), 2.5, False),
        ((0.8,), 0.0, False),
        ((0.8,), 1.0, False),
        ((1.0, 0.5), 0.01, True),
        ((1.0, 0.5), 0.02, False),
    ],
)
def test_shares_that_a_text_may_say(factors: tuple[float, ...], said: float, held: bool) -> None:
    found = [speed(*(count("ego", one, 1.0) for one in factors))]
    assert numbers(*found).supports(share(said)) is held


@pytest.mark.parametrize(
    ("term", "where", "said", "held"),
    [
        (plain(20.0), HIGHWAY, 20.0, True),
        (count("ego", 1.0, 3.0), HIGHWAY, 28.0, True),
        (count("ego", 1.0, -3.0), HIGHWAY, 3.0, True),
        (count("ego", 1.0, 3.0), NOWHERE, 3.0, True),
        (count("ego", 1.0, 3.0), NOWHERE, 28.0, False),
        (count("other", 1.0, 3.0), HIGHWAY, 3.0, True),
        (count("other", 1.0, 3.0), HIGHWAY, 25.0, False),
    ],
)
def test_whether_a_speed_is_the_one_that_is_told(term: Term, where: FactSurroundings, said: float, held: bool) -> None:
    known = numbers(where=where)
    assert known.matches(term, mps(said)) is held
    assert known.matches(term, metres(said)) is False


# By the limit -----------------------------------------------------------------------------------------------------


def test_how_far_the_speeds_wanted_are_from_the_limit() -> None:
    assert numbers(speed(count("limit", 1.0, 2.0), count("limit", 1.0, -2.0))).beside_limit() == [-2.0, 2.0]
    assert numbers(speed(count("limit", 0.9))).beside_limit() == []
    assert numbers(speed(count("ego", 1.0, 3.0))).beside_limit() == []
    assert numbers().beside_limit() == []


WET_OR_DRY = read_facts("""
def drive():
    ego = get_ego_vehicle()
    if get_speed_of(ego) > 20.0:
        speed = get_speed_limit() - 2.0
    else:
        speed = get_speed_limit()
    set_target_speed(speed)
    yield autopilot()
""")


@pytest.mark.parametrize("text", ["I go 2 m/s below the limit.", "I drive at the limit."])
def test_any_of_several_speeds_by_the_limit_may_be_told(text: str) -> None:
    assert judge(text, WET_OR_DRY, HIGHWAY).aligned


def test_all_speeds_by_the_limit_are_told_where_none_is_as_said() -> None:
    def told(text: str) -> list[tuple[str, str, int | None]]:
        return [(one.kind, one.instead, one.line) for one in judge(text, WET_OR_DRY, HIGHWAY).mismatches]

    instead = "it drives at the limit -2 m/s or +0 m/s"
    assert told("I go 5 m/s above the limit.") == [("wrong-number", instead, 8)]
    below = read_facts("def drive():\n    set_target_speed(get_speed_limit() - 2.0)\n    yield autopilot()\n")
    (mismatch,) = judge("I go 5 m/s above the limit.", below, HIGHWAY).mismatches
    assert (mismatch.kind, mismatch.instead) == ("wrong-sign", "it drives at the limit -2 m/s")


# In words ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("found", "kind", "words"),
    [
        ([speed(plain(20.5))], "speed", "20.5 m/s"),
        ([speed(plain(20.0)), speed(plain(20.0004)), speed(plain(-20.0))], "speed", "20 m/s"),
        ([speed(plain(40.29), plain(3.0), plain(5.0))], "speed", "3 m/s and 5 m/s and 40.29 m/s"),
        ([speed(plain(30.0)), speed(plain(20.0))], "speed", "30 m/s and 20 m/s"),
        ([speed(*(plain(float(one)) for one in range(5)))], "speed", "1 m/s and 2 m/s and 3 m/s"),
        ([speed(count("ego"))], "speed", ""),
        ([mark("gap", 30.0), mark("gap", 20.0), mark("past", 10.0)], "distance", "30 m and 20 m"),
        ([event("headway", plain(2.5), plain(2.0))], "time", "2 s and 2.5 s"),
    ],
)
def test_a_programs_numbers_in_words(found: list[Event | FactMark], kind: str, words: str) -> None:
    assert numbers(*found).told(kind) == words


def test_numbers_held_against_a_gap_are_told_in_the_same_order_in_every_run() -> None:
    facts = read_facts("""
def drive():
    ego = get_ego_vehicle()
    front = detect_front_vehicle_in(get_lane_of(ego))
    gap = get_distance_between_vehicles(front, ego) - (5.0 if front else (9.0 if ego else 7.0))
    if gap < 20.0:
        set_target_speed(20.0)
    yield autopilot()
""")
    assert [one.value for one in facts.marks if one.compared] == [20.0, 29.0, 27.0, 25.0]
