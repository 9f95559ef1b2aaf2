"""Facts of programs: what reading finds in every kind of expression and statement, and where it stops."""

from __future__ import annotations

import pytest
from faithfulness_programs import HIGHWAY, facts

from chauffeur.language.quantities import Quantity
from chauffeur.programs import APIS
from chauffeur.safety.faithfulness import FactSurroundings, read_facts
from chauffeur.safety.faithfulness.claims import claims_of
from chauffeur.safety.faithfulness.facts import Event
from chauffeur.safety.faithfulness.numbers import Numbers
from chauffeur.safety.faithfulness.values import Term


def events(body: str, *deeds: str, before: str = "", library: str = "") -> list[Event]:
    found = facts(body, before, library)
    assert found.readable
    return [event for event in found.events if not deeds or event.deed in deeds]


def speeds(body: str, before: str = "", library: str = "") -> list[float]:
    """Plain numbers that the last target speed can be."""
    last = events(body, "speed", before=before, library=library)[-1]
    return sorted(term.offset for term in last.terms if not term.factor)


@pytest.mark.parametrize(
    ("body", "known"),
    [
        ("set_target_speed(20)", [20.0]),
        ("set_target_speed(target_speed=20)", [20.0]),
        ("set_target_speed(True)", []),
        ("set_target_speed('20')", []),
        ("set_target_speed(1e12)", []),
        ("set_target_speed(999999999)", [999999999.0]),
        ("set_target_speed(v := 20)", [20.0]),
        ("if (v := 20) > 3:\n    pass\nset_target_speed(v)", [20.0]),
        ("v: float = 20\nset_target_speed(v)", [20.0]),
        ("v: float\nset_target_speed(20)", [20.0]),
        ("v = w = 20\nset_target_speed(w)", [20.0]),
        ("v = 20\nv += 5\nset_target_speed(v)", [20.0, 25.0]),
        ("v += 5\nset_target_speed(v)", []),
        ("v = -20\nset_target_speed(-v)", [20.0]),
        ("set_target_speed(+20)", [20.0]),
        ("set_target_speed(7 // 2 * 4)", [12.0]),
        ("set_target_speed(7 / 2)", [3.5]),
        ("set_target_speed(7 / 0)", []),
        ("set_target_speed(7 % 2)", []),
        ("set_target_speed(2 - 7)", [-5.0]),
        ("set_target_speed(20 if ego else 30)", [20.0, 30.0]),
        ("set_target_speed(20 or 30)", [20.0, 30.0]),
        ("set_target_speed(0 and 30)", [0.0]),
        ("set_target_speed((20, 30)[1])", [30.0]),
        ("set_target_speed((20, 30)[-1])", [20.0, 30.0]),
        ("set_target_speed((20, 30)[2])", [20.0, 30.0]),
        ("set_target_speed([20, 30][int(ego)])", [20.0, 30.0]),
        ("v, w = 20, 30\nset_target_speed(w)", [30.0]),
        ("[v, w] = (20, 30)\nset_target_speed(v)", [20.0]),
        ("v, w = (20, 30, 40)\nset_target_speed(w)", []),
        ("set_target_speed(max(20, 30))", [20.0, 30.0]),
        ("set_target_speed(min((20, 30)))", [20.0, 30.0]),
        ("set_target_speed(float(20))", [20.0]),
        ("set_target_speed(float())", []),
        ("set_target_speed(pow(20, 1))", []),
        ("set_target_speed((lambda v: v + 1)(20))", []),
        ("f = lambda v: v + 1\nset_target_speed(f(20))", [21.0]),
        ("f = lambda v: v + 1\nset_target_speed(f(v=20))", [21.0]),
        ("for v in (20, 30):\n    set_target_speed(v)", [20.0, 30.0]),
        ("vs = [v + 1 for v in (20, 30)]\nset_target_speed(vs[0])", [21.0, 31.0]),
        ("set_target_speed({20}.pop())", []),
        ("set_target_speed(max({20, 30}))", [20.0, 30.0]),
        ("try:\n    v = 20\nexcept ValueError:\n    v = 30\nelse:\n    v = 40\nset_target_speed(v)", [40.0]),
        ("try:\n    pass\nfinally:\n    v = 50\nset_target_speed(v)", [50.0]),
        ("if ego:\n    v = 20\nelse:\n    v = 30\nset_target_speed(v)", [20.0, 30.0]),
        ("if False:\n    v = 20\nelse:\n    v = 30\nset_target_speed(v)", [30.0]),
        ("if True:\n    v = 20\nelse:\n    v = 30\nset_target_speed(v)", [20.0]),
        ("v = 10\nif False and ego:\n    v = 20\nset_target_speed(v)", [10.0]),
        ("with ego:\n    v = 20\nset_target_speed(v)", [20.0]),
        ("if ego and 3:\n    v = 20\nelse:\n    v = 30\nset_target_speed(v)", [20.0, 30.0]),
        ("while True:\n    v = 20\n    if ego:\n        break\nset_target_speed(v)", [20.0]),
        ("v = 10\nwhile ego:\n    v = 20\nelse:\n    v = 30\nset_target_speed(v)", [30.0]),
        ("v = 10\nfor _ in range(3):\n    v = 20\n    continue\n    v = 30\nset_target_speed(v)", [10.0, 20.0]),
        ("v = 10\nfor _ in range(3):\n    pass\nelse:\n    v = 40\nset_target_speed(v)", [40.0]),
        ("v = 10\nif ego:\n    v = 20\n    raise ValueError\nset_target_speed(v)", [10.0]),
        ("v = 10\nif ego:\n    pass\nelse:\n    return\n    v = 20\nset_target_speed(v)", [10.0]),
    ],
)  # fmt: skip
def test_plain_numbers_are_followed(body: str, known: list[float]) -> None:
    assert speeds(body) == known


def test_functions_are_followed_with_what_they_are_given() -> None:
    helper = "def plus(v, by=3):\n    return v + by\n\n"
    assert speeds("set_target_speed(plus(20, 4))", helper) == [24.0]
    assert speeds("set_target_speed(plus(20, by=5))", helper) == [25.0]
    assert speeds("set_target_speed(plus(20))", helper) == []  # defaults are not followed
    assert speeds("set_target_speed(plus(20, 4))", "", helper) == [24.0]


def test_a_function_that_calls_itself_is_followed_ten_deep() -> None:
    helper = "def down(v):\n    set_target_speed(v)\n    return down(v - 1)\n\n"
    assert len(events("down(30)", "speed", before=helper)) == 9  # the main function is the first of the ten


def test_lines_are_those_of_the_program_also_for_what_a_library_does() -> None:
    library = "def go(v):\n    set_target_speed(v)\n"
    assert [event.line for event in events("go(20)\nset_target_speed(30)", "speed", library=library)] == [3, 4]


def test_a_function_as_a_value_is_followed_where_it_is_called() -> None:
    helper = "def fast():\n    return 30\n\ndef slow():\n    return 20\n\n"
    assert speeds("f = fast if ego else slow\nset_target_speed(f())", helper) == [20.0, 30.0]
    assert speeds("f = 3\nset_target_speed(f())") == []


@pytest.mark.parametrize(
    ("body", "tag"),
    [
        ("say(f'{get_speed_of(ego):.1f} m/s')", "speed"),
        ("say(str(get_speed_limit()))", "limit"),
        ("say(get_speed_limit().real)", "limit"),
        ("say('a' if detect_stop_sign_ahead() > 0 else 'b')", "sign"),
        ("say(*[get_speed_limit()])", "limit"),
        ("say([v for v in (1, 2) if get_speed_limit() > v])", "limit"),
        ("say(get_distance_between_vehicles(detect_front_vehicle_in(get_lane_of(ego)), ego))", "gap"),
        ("say(get_distance_between_vehicles(ego, detect_rear_vehicle_in(get_lane_of(ego))))", "behind"),
        ("say(get_distance_between_vehicles(ego, detect_front_vehicle_in(get_lane_of(ego))))", "past"),
        ("say(get_desired_time_headway())", "headway"),
        ("say(is_safe_enter(get_left_lane(ego)))", "safe:-1"),
        ("say(is_safe_enter(get_right_to_left_cross_traffic_lanes()))", "safe:cross:right"),
        ("say(is_safe_enter(ego))", "safe:?"),
        ("say(get_left_lane(detect_front_vehicle_in(get_lane_of(ego))))", "front"),
        ("if get_target_speed() > 3:\n    say('fast')", "speed"),
        ("while is_safe_enter(get_right_lane(ego)):\n    yield autopilot()\nsay('now')", "safe:1"),
        ("for i in range(9):\n    if detect_stop_sign_ahead() < 5:\n        break\nsay('now')", "sign"),
    ],
)
def test_what_a_deed_depends_on(body: str, tag: str) -> None:
    assert tag in events(body, "say")[-1].depends


def test_two_cars_of_which_nothing_is_known_have_no_gap() -> None:
    assert not events("say(get_distance_between_vehicles(detect_front_vehicle_in(get_lane_of(ego)), "
                      "detect_rear_vehicle_in(get_lane_of(ego))))", "say")[-1].terms  # fmt: skip


def test_times_of_loops_are_spans() -> None:
    assert 3.0 in facts("for _ in range(30):\n    yield autopilot()").spans_s
    assert 2.0 in facts("for _ in range(10, 30):\n    yield autopilot()").spans_s
    assert 5.0 in facts("t = 0\nwhile t < 50:\n    t = t + 1\n    yield autopilot()").spans_s
    assert facts("for _ in (1, 2):\n    yield autopilot()").spans_s == ()
    assert facts("for _ in range(int(get_speed_of(ego))):\n    yield autopilot()").spans_s == ()


def test_a_loop_that_only_waits_is_a_wait() -> None:
    assert [(event.deed, event.terms) for event in events("for _ in range(30):\n    yield autopilot()")] == [
        ("wait", frozenset({Term("", 0.0, 3.0)}))
    ]
    assert events("for _ in range(30):\n    x = 1\n    yield autopilot()", "wait") == []
    assert events("for _ in (1, 2):\n    yield autopilot()", "wait") == []


@pytest.mark.parametrize(
    ("body", "times"),
    [
        ("set_target_lane(get_left_lane(ego))", 1),
        ("for _ in range(2):\n    set_target_lane(get_left_lane(ego))", 2),
        ("for _ in range(2):\n    for _ in range(3):\n        set_target_lane(get_left_lane(ego))", 6),
        ("n = 0\nwhile n < 4:\n    n = n + 1\n    set_target_lane(get_left_lane(ego))", 4),
        ("while 0 < 4:\n    set_target_lane(get_left_lane(ego))", 4),
        ("while 3 < 8:\n    set_target_lane(get_left_lane(ego))", 5),
        ("while 8 > 3:\n    set_target_lane(get_left_lane(ego))", 5),
        ("while ego:\n    set_target_lane(get_left_lane(ego))", 0),
        ("for _ in (1, 2):\n    set_target_lane(get_left_lane(ego))", 0),
        ("for _ in get_left_to_right_cross_traffic_lanes():\n    set_target_lane(get_left_lane(ego))", 1),
    ],
)
def test_how_often_a_deed_is_done(body: str, times: int) -> None:
    assert events(body, "lane")[0].times == times


def test_lanes_back_are_told_from_lanes_onward() -> None:
    there = "lane = get_lane_of(ego)\nset_target_lane(get_left_lane(ego))\nyield autopilot()\n"
    out, home = events(f"{there}set_target_lane(lane)", "lane")
    assert (out.sides, out.back) == (frozenset({-1}), False)
    assert (home.sides, home.back) == (frozenset({1}), True)
    again = events(f"{there}set_target_lane(get_right_lane(ego))", "lane")[1]
    assert (again.sides, again.back) == (frozenset({1}), True)
    on = events(f"{there}set_target_lane(get_left_lane(ego))", "lane")[1]
    assert (on.sides, on.back) == (frozenset({-1}), False)


def test_a_lane_is_checked_when_it_was_asked_about() -> None:
    move = "set_target_lane(get_left_lane(ego))"
    assert not events(move, "lane")[0].checked
    assert events(f"if is_safe_enter(get_left_lane(ego)):\n    {move}", "lane")[0].checked
    assert not events(f"if is_safe_enter(get_right_lane(ego)):\n    {move}", "lane")[0].checked
    assert events(f"if is_safe_enter(ego):\n    {move}", "lane")[0].checked
    assert not events("if is_safe_enter(get_right_lane(ego)):\n    set_target_lane(ego)", "lane")[0].checked


def test_leaving_a_stop_sign_is_checked_when_crossing_traffic_was_asked_about() -> None:
    assert not events("recover_from_stop()", "go")[0].checked
    asked = (
        "for lane in get_left_to_right_cross_traffic_lanes():\n    if is_safe_enter(lane):\n        recover_from_stop()"
    )
    assert events(asked, "go")[0].checked


def test_ways_over_an_intersection() -> None:
    for name, side in (("turn_left", -1), ("go_straight", 0), ("turn_right", 1)):
        assert events(f"{name}_at_next_intersection()", "turn")[0].sides == frozenset({side})


def test_every_wish_of_the_catalogue_is_noted() -> None:
    """A new one has to be given a deed of its own: what is not known is taken for a lane."""
    deeds = {
        "say": "say", "set_target_speed": "speed", "set_desired_time_headway": "headway", "set_target_lane": "lane",
        "recover_from_stop": "go", "turn_left_at_next_intersection": "turn", "go_straight_at_next_intersection": "turn",
        "turn_right_at_next_intersection": "turn",
    }  # fmt: skip
    assert {api.name for api in APIS.values() if api.effect != "read"} == deeds.keys()
    for name, deed in deeds.items():
        given = "" if APIS[name].params == () else "3"
        assert [event.deed for event in events(f"{name}({given})")] == [deed]


GAP = "front = detect_front_vehicle_in(get_lane_of(ego))\ngap = get_distance_between_vehicles(front, ego)\n"


@pytest.mark.parametrize(
    ("body", "marks"),
    [
        ("say(gap < 30)", {("gap", 30.0, True)}),
        ("say(30 > gap)", {("gap", 30.0, True)}),
        ("say(gap - 5 < 25)", {("gap", 25.0, True), ("gap", 30.0, True), ("gap", 5.0, False)}),
        ("say(get_speed_of(ego) > 20)", {("ego", 20.0, True)}),
        ("say(3 < 4)", set()),
    ],
)
def test_numbers_that_measured_things_are_held_against(body: str, marks: set[tuple[str, float, bool]]) -> None:
    found = facts(GAP + body)
    assert {(mark.base, mark.value, mark.compared) for mark in found.marks} == marks
    assert all(mark.line == 5 for mark in found.marks)


def test_a_gap_that_is_steered_towards_is_a_deed() -> None:
    steered = events(f"{GAP}set_target_speed(20 + 0.5 * (gap - 25))", "gap")
    assert [(one.terms, one.reference) for one in steered] == [(frozenset({Term("", 0.0, 25.0)}), True)]
    # What is taken off a gap before something unknown is, is no gap that is wanted.
    assert events(f"{GAP}say((gap - 5) - get_distance_between_vehicles(front, ego))", "gap") == []
    assert events(f"{GAP}say((gap - 5) - 3)", "gap") != []
    assert events(f"{GAP}say(get_speed_limit() - gap)", "gap") == []


def test_a_controller_towards_a_speed_is_a_deed_but_not_one_towards_anothers() -> None:
    wanted = events("say(25 - get_speed_of(ego))", "speed")
    assert [(one.terms, one.reference) for one in wanted] == [(frozenset({Term("", 0.0, 25.0)}), True)]
    assert events(f"{GAP}say(get_speed_of(front) - get_speed_of(ego))", "speed") == []
    assert events("say(get_speed_of(ego) - get_speed_of(ego))", "speed") == []


@pytest.mark.parametrize(
    "source",
    [
        "",
        "def f(:",
        "x = 1",
        "def drive(n):\n    yield autopilot()\n",
        "def drive():\n    yield '\x00'\n",
        f"def drive():\n    x = {'(' * 300}1{')' * 300}\n    yield autopilot()\n",
        "def drive():\n" + "    set_target_speed(1)\n" * 500 + "    yield autopilot()\n",
        "def drive():\n" + "    x = 1\n" * 30_000 + "    yield autopilot()\n",
    ],
)
def test_what_cannot_be_read_is_not_judged(source: str) -> None:
    assert not read_facts(source).readable


def test_a_library_that_cannot_be_read_spoils_the_program() -> None:
    assert not read_facts("def drive():\n    yield autopilot()\n", "def f(:").readable


def test_more_steps_than_are_worth_reading_are_not_read() -> None:
    helpers = "def a():\n    x = 1\n\n"
    for name, called in (("b", "a"), ("c", "b"), ("d", "c")):
        helpers += f"def {name}():\n" + f"    {called}()\n" * 30 + "\n"
    assert facts("c()", helpers).readable
    assert not facts("d()", helpers).readable


def test_a_break_outside_a_loop_ends_what_is_followed() -> None:
    assert speeds("if ego:\n    set_target_speed(20)\n    break\n    set_target_speed(30)") == [20.0]


def test_a_lane_that_only_the_name_is_known_of() -> None:
    assert events("say(3)\nsay(gap - 5)\nsay(get_lane_of(ego))", "gap") == []
    assert events(f"{GAP}say(gap - get_speed_limit())", "gap") == []


NOWHERE = FactSurroundings()


def numbers(body: str, where: FactSurroundings = HIGHWAY) -> Numbers:
    return Numbers(facts(GAP + body), where)


@pytest.mark.parametrize(
    ("body", "where", "signs"),
    [
        ("set_target_speed(30)", HIGHWAY, {1}),
        ("set_target_speed(25.3)", HIGHWAY, {0}),
        ("set_target_speed(24)", HIGHWAY, {-1}),
        ("set_target_speed(24)", NOWHERE, set()),
        ("set_target_speed(get_speed_of(ego) + 3)", NOWHERE, {1}),
        ("set_target_speed(0.8 * get_speed_of(ego))", NOWHERE, {-1}),
        ("set_target_speed(0.8 * get_speed_of(ego))", HIGHWAY, {-1}),
        ("set_target_speed(0.8 * get_speed_of(ego) + 10)", HIGHWAY, {1}),
        ("set_target_speed(get_speed_limit() - 1)", HIGHWAY, {1}),
        ("set_target_speed(get_speed_limit() - 1)", NOWHERE, set()),
        ("set_target_speed(get_speed_of(front))", HIGHWAY, {-1}),
        ("set_target_speed(20 if ego else 30)", HIGHWAY, {-1, 1}),
        ("x = 1", HIGHWAY, set()),
    ],
)
def test_which_way_a_speed_changes(body: str, where: FactSurroundings, signs: set[int]) -> None:
    assert numbers(body, where).signs() == signs


@pytest.mark.parametrize(
    ("body", "where", "signs"),
    [
        ("set_desired_time_headway(2)", HIGHWAY, {1}),
        ("set_desired_time_headway(1)", HIGHWAY, {-1}),
        ("set_desired_time_headway(1.5)", HIGHWAY, {0}),
        ("set_desired_time_headway(60 / get_speed_of(ego))", HIGHWAY, {1}),
        ("set_desired_time_headway(60 / get_speed_of(ego))", NOWHERE, set()),
        ("set_desired_time_headway(0.5 * get_desired_time_headway())", HIGHWAY, {-1}),
        ("set_desired_time_headway(get_desired_time_headway() + 0.5)", HIGHWAY, {1}),
        ("set_desired_time_headway(get_speed_limit())", HIGHWAY, set()),
        ("set_target_speed(20 + 0.5 * (gap - 25))", HIGHWAY, {-1}),
        ("set_target_speed(20 + 0.5 * (gap - 60))", HIGHWAY, {1}),
        ("set_target_speed(20 + 0.5 * (gap - 60))", NOWHERE, set()),
        ("set_target_speed(20 + 0.5 * (gap - 2 * get_speed_of(ego)))", HIGHWAY, {1}),
        ("say(gap < 30)", HIGHWAY, {-1}),
        ("say(gap < 30)", NOWHERE, set()),
        ("x = 1", HIGHWAY, set()),
    ],
)
def test_which_way_a_gap_changes(body: str, where: FactSurroundings, signs: set[int]) -> None:
    assert numbers(body, where).gap_signs() == signs


@pytest.mark.parametrize(
    ("body", "where", "said", "held"),
    [
        ("set_target_speed(30)", HIGHWAY, Quantity(30.0, "speed", "30 m/s"), True),
        ("set_target_speed(30)", HIGHWAY, Quantity(28.0, "speed", "28 m/s"), False),
        ("set_target_speed(get_speed_of(ego) + 3)", HIGHWAY, Quantity(28.0, "speed", "28 m/s"), True),
        ("say(gap < 30)", HIGHWAY, Quantity(30.0, "distance", "30 m"), True),
        ("say(gap < 30)", HIGHWAY, Quantity(34.0, "distance", "34 m"), False),
        ("x = 1", HIGHWAY, Quantity(40.0, "distance", "40 m"), True),
        ("x = 1", NOWHERE, Quantity(40.0, "distance", "40 m"), False),
        ("x = 1", FactSurroundings(sign_m=50.0), Quantity(50.0, "distance", "50 m"), True),
        ("set_target_speed(20 + 0.5 * (gap - 25))", HIGHWAY, Quantity(25.0, "distance", "25 m"), True),
        ("set_target_speed(20 + 0.5 * (gap - 25))", HIGHWAY, Quantity(15.0, "distance", "15 m"), True),
        ("set_target_speed(20 + 0.5 * (gap - 25))", NOWHERE, Quantity(15.0, "distance", "15 m"), False),
        ("set_target_speed(20 + 0.5 * (gap - 2 * get_speed_of(ego)))", HIGHWAY, Quantity(2.0, "time", "2 s"), True),
        ("set_desired_time_headway(2)", HIGHWAY, Quantity(50.0, "distance", "50 m"), True),
        ("set_desired_time_headway(2)", NOWHERE, Quantity(50.0, "distance", "50 m"), False),
        ("set_desired_time_headway(60 / get_speed_of(ego))", HIGHWAY, Quantity(60.0, "distance", "60 m"), True),
        ("set_desired_time_headway(60 / get_speed_of(ego))", HIGHWAY, Quantity(2.4, "time", "2.4 s"), True),
        ("set_desired_time_headway(2)", HIGHWAY, Quantity(2.0, "time", "2 s"), True),
        ("set_desired_time_headway(2)", HIGHWAY, Quantity(3.0, "time", "3 s"), False),
        ("x = 1", HIGHWAY, Quantity(1.6, "time", "1.6 s"), True),  # 40 m at 25 m/s
        ("x = 1", NOWHERE, Quantity(1.7, "time", "1.7 s"), False),
        ("for _ in range(30):\n    yield autopilot()", HIGHWAY, Quantity(3.0, "time", "3 s"), True),
        ("set_target_speed(0.8 * get_speed_of(ego))", HIGHWAY, Quantity(0.2, "share", "20 %"), True),
        ("set_target_speed(0.8 * get_speed_of(ego))", HIGHWAY, Quantity(0.5, "share", "50 %"), False),
        ("set_target_speed(30)", HIGHWAY, Quantity(0.5, "share", "half"), True),
        ("x = 1", HIGHWAY, Quantity(7.0, "other", "7 cars"), True),
    ],
)
def test_numbers_of_a_text_that_a_program_has(body: str, where: FactSurroundings, said: Quantity, held: bool) -> None:
    assert numbers(body, where).supports(said, exact=False) is held


def test_a_program_tells_its_own_numbers() -> None:
    told = numbers("set_target_speed(30)\nsay(gap < 20)\nset_desired_time_headway(2)")
    assert [told.told(kind) for kind in ("speed", "distance", "time", "share")] == ["30 m/s", "20 m", "2 s", ""]


# Claims ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "matter", "expected"),
    [
        ("I drive faster than the limit.", "speed", {"sign": 0}),
        ("I speed up by 5 m/s.", "speed", {"sign": 1}),
        ("I wait until the car is closer.", "other gap", {"firm": True, "quantities": ()}),
        ("I keep the usual distance.", "nothing", {"sides": frozenset({3})}),
        ("The headway is left as it is: no change.", "nothing", {}),
        ("The gap stays unchanged.", "nothing", {"sides": frozenset({3})}),
        ("I change to the left lane without waiting.", "lane", {"denied": False}),
    ],
)
def test_claims(text: str, matter: str, expected: dict[str, object]) -> None:
    found = [claim for claim in claims_of(text) if claim.matter == matter]
    assert found, [claim.matter for claim in claims_of(text)]
    assert {name: getattr(found[0], name) for name in expected} == expected
