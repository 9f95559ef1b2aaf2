"""What is known of a value: alternatives that are put together, calculated with, and held as bounds."""

from __future__ import annotations

import ast
import math

import pytest

from chauffeur.safety.faithfulness.values import (
    MAX_TERMS,
    NOTHING,
    LaneValue,
    Term,
    TracedValue,
    bounded,
    combined,
    either,
    in_order,
    negated,
    number,
    of,
    tags_of,
)

FIRST, SECOND, THIRD = ast.Pass(), ast.Pass(), ast.Pass()
LEFT, OWN = LaneValue(-1, frozenset({0})), LaneValue(0, frozenset({0}))


def value(*terms: Term) -> TracedValue:
    return TracedValue(frozenset(terms))


def plain(offset: float, *, bound: bool = False) -> Term:
    return Term("", 0.0, offset, bound)


def test_a_plain_number_counts_from_nothing() -> None:
    assert number(20.0) == TracedValue(frozenset({Term("", 0.0, 20.0, bound=False)}))
    assert number(0.0) == TracedValue(frozenset({Term("", 0.0, 0.0, bound=False)}))
    for endless in (math.inf, -math.inf, math.nan):
        assert number(endless) == NOTHING


def test_what_the_car_is_asked_for_counts_from_it() -> None:
    assert of("gap", "gap", "front") == TracedValue(frozenset({Term("gap", 1.0, 0.0)}), frozenset({"gap", "front"}))
    assert of("ego") == TracedValue(frozenset({Term("ego", 1.0, 0.0)}), frozenset())


def test_constants_are_plain_numbers_by_size() -> None:
    assert value(plain(30.0), plain(4.0), Term("ego", 1.0, 7.0), Term("ego", -0.5, 1.0)).constants == (4.0, 30.0)
    assert NOTHING.constants == ()


def test_alternatives_of_a_set_are_told_in_one_order() -> None:
    ordered = [
        plain(-3.0), Term("", 0.0, 2.0), Term("", 0.0, 2.0, bound=True), Term("ego", 0.5, 2.0), Term("ego", 1.0, 2.0),
        Term("other", 1.0, 2.0), plain(30.0),
    ]  # fmt: skip
    assert in_order(reversed(ordered)) == ordered
    assert in_order(ordered[3:] + ordered[:3]) == ordered


# Alternatives -----------------------------------------------------------------------------------------------------


def test_one_of_none_is_not_known_and_one_of_one_is_itself() -> None:
    assert either([]) == NOTHING
    one = TracedValue(frozenset({plain(1.0)}), frozenset({"gap"}), open=True, crossing="left", vehicle="ego")
    assert either(iter([one])) is one


def test_one_of_several_has_what_each_has() -> None:
    one = TracedValue(
        frozenset({plain(1.0)}),
        frozenset({"gap"}),
        frozenset({LEFT}),
        functions=(FIRST, SECOND),
        items=(number(1.0),),
    )
    other = TracedValue(
        frozenset({plain(2.0)}),
        frozenset({"speed"}),
        frozenset({OWN}),
        vehicle="front",
        crossing="left",
        functions=(SECOND, THIRD),
        items=(number(-1.0), number(2.0)),
    )
    assert either([one, other]) == TracedValue(
        frozenset({plain(1.0), plain(2.0)}),
        frozenset({"gap", "speed"}),
        frozenset({LEFT, OWN}),
        vehicle="front",
        crossing="left",
        functions=(FIRST, SECOND, THIRD),
        items=(number(-1.0), number(2.0)),
    )


def test_of_two_vehicles_the_first_is_named() -> None:
    assert either([NOTHING, TracedValue(vehicle="rear"), TracedValue(vehicle="front")]).vehicle == "rear"
    assert either([number(1.0), number(2.0)]).vehicle == ""


@pytest.mark.parametrize(
    ("sides", "both"),
    [(("", ""), ""), (("left", ""), "left"), (("left", "left"), "left"), (("left", "right"), "both")],
)
def test_lanes_that_cross_from_two_sides_cross_from_both(sides: tuple[str, str], both: str) -> None:
    one, other = (TracedValue(crossing=side) for side in sides)
    assert either([one, other]).crossing == both
    assert combined(one, ast.Add(), other).crossing == both
    assert combined(other, ast.Add(), one).crossing == both


def test_another_number_is_possible_where_one_alternative_is_not_known() -> None:
    known, unsure = number(1.0), TracedValue(frozenset({plain(2.0)}), open=True)
    assert either([known, number(2.0)]).open is False
    assert either([known, NOTHING]).open is True
    assert either([known, unsure]).open is True
    assert either([NOTHING, NOTHING]).open is True


def test_of_more_alternatives_than_are_followed_none_is_known() -> None:
    assert len(either([number(float(one)) for one in range(MAX_TERMS)]).terms) == MAX_TERMS == 12
    assert either([number(float(one)) for one in range(MAX_TERMS + 1)]).terms == frozenset()
    three = value(plain(1.0), plain(2.0), plain(3.0))
    four = value(plain(10.0), plain(20.0), plain(30.0), plain(40.0))
    assert len(combined(four, ast.Add(), three).terms) == MAX_TERMS
    five = value(*four.terms, plain(50.0))
    assert combined(five, ast.Add(), three).terms == frozenset()


# Bounds -----------------------------------------------------------------------------------------------------------

OWN_SPEED = of("ego", "speed")


@pytest.mark.parametrize(
    ("members", "terms"),
    [
        ([number(20.0), number(30.0)], {plain(20.0), plain(30.0)}),
        ([number(20.0)], {plain(20.0)}),
        ([number(20.0), OWN_SPEED], {plain(20.0, bound=True), Term("ego", 1.0, 0.0)}),
        ([OWN_SPEED, number(20.0)], {plain(20.0, bound=True), Term("ego", 1.0, 0.0)}),
        ([number(20.0), NOTHING], {plain(20.0, bound=True)}),
        ([value(plain(20.0), Term("ego", 1.0, 0.0))], {plain(20.0), Term("ego", 1.0, 0.0)}),
        ([], set[Term]()),
    ],
)
def test_a_plain_number_beside_another_is_only_a_bound(members: list[TracedValue], terms: set[Term]) -> None:
    assert bounded(iter(members)).terms == terms


def test_what_a_bound_depends_on_is_kept() -> None:
    found = bounded([TracedValue(frozenset({plain(3.0)}), frozenset({"gap"})), OWN_SPEED])
    assert found.tags == {"gap", "speed"}


# Calculating ------------------------------------------------------------------------------------------------------

ADD, SUB, MULT, DIV, FLOOR, MOD = ast.Add(), ast.Sub(), ast.Mult(), ast.Div(), ast.FloorDiv(), ast.Mod()
GAP = Term("gap", 2.0, 6.0)
EGO = Term("ego", 1.0, 0.0)


@pytest.mark.parametrize(
    ("left", "op", "right", "result"),
    [
        (plain(7.0), ADD, plain(2.0), plain(9.0)),
        (GAP, ADD, plain(3.0), Term("gap", 2.0, 9.0)),
        (plain(3.0), ADD, GAP, Term("gap", 2.0, 9.0)),
        (GAP, ADD, EGO, None),
        (plain(7.0), SUB, plain(2.0), plain(5.0)),
        (GAP, SUB, plain(2.0), Term("gap", 2.0, 4.0)),
        (plain(2.0), SUB, GAP, Term("gap", -2.0, -4.0)),
        (GAP, SUB, GAP, None),
        (plain(7.0), MULT, plain(2.0), plain(14.0)),
        (GAP, MULT, plain(0.5), Term("gap", 1.0, 3.0)),
        (plain(0.5), MULT, GAP, Term("gap", 1.0, 3.0)),
        (GAP, MULT, plain(0.0), plain(0.0)),
        (plain(0.0), MULT, GAP, plain(0.0)),
        (GAP, MULT, GAP, None),
        (plain(7.0), DIV, plain(2.0), plain(3.5)),
        (GAP, DIV, plain(2.0), Term("gap", 1.0, 3.0)),
        (GAP, DIV, plain(0.0), None),
        (plain(60.0), DIV, EGO, Term("per speed", 1.0, 60.0)),
        (plain(60.0), DIV, Term("ego", 1.0, 1.0), None),
        (plain(60.0), DIV, Term("other", 1.0, 0.0), None),
        (GAP, DIV, EGO, None),
        (plain(7.0), FLOOR, plain(2.0), plain(3.0)),
        (plain(7.0), FLOOR, plain(0.0), None),
        (GAP, FLOOR, plain(2.0), None),
        (plain(2.0), FLOOR, GAP, None),
        (plain(7.0), MOD, plain(2.0), None),
        (plain(1e308), MULT, plain(1e308), None),
    ],
)
def test_numbers_are_calculated_with_as_far_as_they_are_known(
    left: Term, op: ast.operator, right: Term, result: Term | None
) -> None:
    found = combined(value(left), op, value(right)).terms
    assert found == (frozenset() if result is None else {result})
    if result is not None and EGO not in (left, right):
        one, other = Term(left.base, left.factor, left.offset, bound=True), value(right)
        (marked,) = combined(value(one), op, other).terms
        assert marked == Term(result.base, result.factor, result.offset, bound=True)
        one, other = value(left), value(Term(right.base, right.factor, right.offset, bound=True))
        (marked,) = combined(one, op, other).terms
        assert marked == Term(result.base, result.factor, result.offset, bound=True)
    if result is not None:
        (term,) = found
        assert term.bound is False


def test_a_bound_divided_by_the_own_speed_stays_one() -> None:
    assert combined(value(plain(60.0, bound=True)), DIV, value(EGO)).terms == {Term("per speed", 1.0, 60.0, bound=True)}


def test_every_alternative_is_calculated_with() -> None:
    found = combined(value(plain(1.0), EGO), SUB, value(plain(2.0), plain(3.0)))
    assert found.terms == {plain(-1.0), plain(-2.0), Term("ego", 1.0, -2.0), Term("ego", 1.0, -3.0)}


def test_a_result_depends_on_both_sides_and_is_as_sure_as_both() -> None:
    unsure = TracedValue(frozenset({plain(1.0)}), frozenset({"gap"}), open=True)
    found = combined(unsure, ADD, of("ego", "speed"))
    assert (found.tags, found.open) == (frozenset({"gap", "speed"}), True)
    assert combined(number(2.0), ADD, unsure).open is True
    assert combined(number(2.0), ADD, number(1.0)).open is False


def test_only_a_sum_puts_rows_together() -> None:
    one, other = (TracedValue(items=(number(size),)) for size in (1.0, 2.0))
    assert combined(one, ADD, other).items == (number(1.0), number(2.0))
    for op in (SUB, MULT):
        assert combined(one, op, other).items == ()


def test_the_opposite_of_a_number() -> None:
    before = TracedValue(frozenset({Term("gap", 2.0, 6.0, bound=True), plain(3.0)}), frozenset({"gap"}), open=True)
    after = TracedValue(frozenset({Term("gap", -2.0, -6.0, bound=True), plain(-3.0)}), frozenset({"gap"}), open=True)
    assert negated(before) == after


def test_several_values_depend_on_what_any_depends_on() -> None:
    assert tags_of((of("ego", "speed"), NOTHING, of("gap", "gap", "front"))) == {"speed", "gap", "front"}
