"""What is known of a program's expressions: names, calls, rows, and what each depends on."""

from __future__ import annotations

import faithfulness_programs
import pytest

from chauffeur.safety.faithfulness import Facts
from chauffeur.safety.faithfulness.facts import Event

EGO = "get_ego_vehicle()"
FREE = f"is_safe_enter(get_left_lane({EGO}))"
WAIT = f"def wait():\n    while not {FREE}:\n        yield autopilot()\n\n"
GO_LEFT = "set_target_lane(get_left_lane(ego))"
CROSSING = "get_left_to_right_cross_traffic_lanes()"


def facts(body: str, before: str = "") -> Facts:
    found = faithfulness_programs.facts(body, before)
    assert found.readable
    return found


def last(body: str, before: str = "") -> Event:
    return facts(body, before).events[-1]


def speeds(body: str, before: str = "") -> list[float]:
    """Plain numbers that the last target speed can be."""
    return sorted(term.offset for term in last(body, before).terms if not term.factor)


@pytest.mark.parametrize(
    ("body", "known"),
    [
        ("set_target_speed(1e9)", []),
        ("v = 20\nset_target_speed(w := v)", [20.0]),
        ("v = 20\nset_target_speed(target_speed=v)", [20.0]),
        ("set_target_speed(-20 + 50)", [30.0]),
        ("v = 20\nf = lambda: v\nset_target_speed(f())", [20.0]),
        ("v = 30\nset_target_speed([v for _ in (1, 2)][0])", [30.0]),
        ("set_target_speed((20, 30)[0])", [20.0]),
        ("set_target_speed((20, 30)[2])", [20.0, 30.0]),
        ("set_target_speed(max([20 for _ in (1, 2)]))", [20.0]),
        ("set_target_speed()", []),
        *((f"set_target_speed({name}(20))", [20.0]) for name in ("float", "int", "round", "abs")),
        *((f"set_target_speed({name}((20, 30))[1])", [30.0]) for name in ("list", "tuple", "sorted")),
        ("set_target_speed(all([20 for _ in (1, 2)]))", []),
        ("set_target_speed(any([20 for _ in (1, 2)]))", []),
    ],
)
def test_numbers_that_a_speed_can_be(body: str, known: list[float]) -> None:
    assert speeds(body) == known


@pytest.mark.parametrize(
    ("body", "known"),
    [
        (f"if {FREE}:\n    [{GO_LEFT} for _ in (1,)]", {"safe:-1"}),
        (f"while not {FREE}:\n    yield autopilot()\n[{GO_LEFT} for _ in (1,)]", {"safe:-1"}),
        (
            f"while not {FREE}:\n    yield autopilot()\nif get_speed_limit() > 3:\n    [{GO_LEFT} for _ in (1,)]",
            {"safe:-1", "limit"},
        ),
        ("say([1 for a in (get_speed_limit(),) for b in (2,)])", {"limit"}),
        ("say(get_speed_limit() - get_speed_of(ego))", {"limit", "speed"}),
        ("v = get_speed_limit()\nsay(v.is_integer())", {"limit"}),
        ("v = 3\nsay(v(get_speed_limit()))", {"limit"}),
        ("say(max((), default=get_speed_limit()))", {"limit"}),
        ("say(round(3, get_speed_limit()))", {"limit"}),
        ("say(any([get_speed_limit()]))", {"limit"}),
        ("say(get_speed_limit() and get_speed_of(ego))", {"limit", "speed"}),
        (
            f"for lane in {CROSSING}:\n    say(all(is_safe_enter(one) for one in (lane,)))",
            {"safe:cross", "safe:cross:left"},
        ),
        (f"say(all(is_safe_enter(lane) for lane in {CROSSING}))", {"safe:cross", "safe:cross:left"}),
    ],
)
def test_what_a_deed_depends_on(body: str, known: set[str]) -> None:
    assert last(body).depends == known


def test_a_speed_that_is_steered_towards_depends_on_what_it_was_taken_from() -> None:
    steered, said = facts("say(get_speed_limit() - get_speed_of(ego))").events
    assert (steered.deed, steered.reference, steered.depends) == ("speed", True, frozenset({"limit"}))
    assert said.deed == "say"


@pytest.mark.parametrize(
    ("body", "known"),
    [
        (f"yield from wait()\n{GO_LEFT}", {"safe:-1"}),
        (f"wait()\n{GO_LEFT}", set[str]()),  # nothing waits: a generator that is not asked does not run
        (f"while get_speed_limit() > 3:\n    yield autopilot()\nyield from wait()\n{GO_LEFT}", {"safe:-1", "limit"}),
        ("say(wait())", {"safe:-1"}),
    ],
)
def test_what_comes_after_a_helper_that_waits_depends_on_what_it_waits_for(body: str, known: set[str]) -> None:
    assert last(body, WAIT).depends == known


HELPER = "def go():\n    set_target_speed(20)\n\n"


@pytest.mark.parametrize(
    ("body", "known"),
    [
        ("go()", set[str]()),
        ("if get_speed_limit() > 3:\n    go()", {"limit"}),
        (f"while not {FREE}:\n    yield autopilot()\ngo()", {"safe:-1"}),
        (f"while not {FREE}:\n    yield autopilot()\nif get_speed_limit() > 3:\n    go()", {"safe:-1", "limit"}),
    ],
)
def test_what_a_helper_does_depends_on_where_it_is_called(body: str, known: set[str]) -> None:
    assert last(body, HELPER).depends == known


def test_after_a_helper_the_line_is_that_of_its_caller() -> None:
    helper = "def pace():\n    say('now')\n    return 20\n\n"
    assert [(one.deed, one.line) for one in facts("set_target_speed(pace())", helper).events] == [
        ("say", 2),
        ("speed", 7),
    ]


def test_a_helper_called_in_a_loop_leaves_the_ways_out_of_it_known() -> None:
    body = "for i in range(9):\n    calm()\n    if get_speed_limit() > 3:\n        break\nsay('now')"
    assert last(body, "def calm():\n    x = 1\n\n").depends == {"limit"}


def test_a_loop_outside_of_functions_is_followed() -> None:
    assert speeds("set_target_speed(v)", "v = 20\nfor i in range(3):\n    w = i\n\n") == [20.0]
    assert speeds("set_target_speed(v)", "v = 20\nwhile v < 3:\n    w = v\n\n") == [20.0]


def chain(length: int) -> str:
    """Helpers that call each the next, and before that one that does nothing; the last returns 20."""
    helpers = "def nothing():\n    x = 1\n\n"
    for place in range(1, length):
        helpers += f"def helper_{place}():\n    nothing()\n    return helper_{place + 1}()\n\n"
    return helpers + f"def helper_{length}():\n    return 20\n\n"


@pytest.mark.parametrize(("length", "known"), [(1, [20.0]), (9, [20.0]), (10, []), (15, [])])
def test_helpers_are_followed_ten_deep_however_many_were_called_before(length: int, known: list[float]) -> None:
    assert speeds("set_target_speed(helper_1())", chain(length)) == known


def test_many_helpers_one_after_the_other_are_followed() -> None:
    assert speeds("nothing()\n" * 30 + "set_target_speed(helper_1())", chain(1)) == [20.0]


@pytest.mark.parametrize(
    ("iterated", "times"),
    [
        (CROSSING, 1),
        (f"[*{CROSSING}, *get_right_to_left_cross_traffic_lanes()]", 1),
        (f"(1, {CROSSING})", 1),
        (f"reversed({CROSSING})", 1),
        (f"enumerate({CROSSING})", 1),
        (f"list({CROSSING})", 1),
        ("(1, 2)", 0),
        ("enumerate((1, 2))", 0),
    ],
)
def test_lanes_that_cross_are_gone_through_once(iterated: str, times: int) -> None:
    assert last(f"for lane in {iterated}:\n    {GO_LEFT}").times == times


def test_an_argument_that_is_not_given_is_not_known() -> None:
    maybe = "def go(v=None):\n    if get_ego_vehicle():\n        v = 20\n    set_target_speed(v)\n\n"
    found = last("go()", maybe)
    assert ([term.offset for term in found.terms], found.open) == ([20.0], True)
    assert not last("go(30)", maybe).open
    assert speeds("go(v=30)", maybe) == [20.0, 30.0]


def test_an_argument_hides_a_function_of_its_name() -> None:
    assert facts("go()", "def go(say=None):\n    say('now')\n\n").events == ()
    assert last("go()", "def go():\n    say('now')\n\n").deed == "say"
