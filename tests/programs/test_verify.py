"""The verifier: what it says of small programs whose meaning is plain."""

from __future__ import annotations

import math

import pytest

from chauffeur.concept import Observation, VehicleState
from chauffeur.programs import ProgramSyntaxError, check_source
from chauffeur.programs.verify import Circumstances, Value, verify
from roads import a_lane, a_road


def body(text: str, head: str = "") -> str:
    lines = "".join(f"    {line}\n" for line in text.strip("\n").split("\n"))
    return f"{head}def main():\n    ego = get_ego_vehicle()\n{lines}    yield autopilot()\n"


def argument(source: str, name: str = "set_target_speed", where: Circumstances | None = None) -> Value:
    """What the only call of an API is given first."""
    report = verify(source) if where is None else verify(source, "", where)
    assert report.complete
    (site,) = [site for site in report.calls if site.name == name]
    return site.arguments[0].value


SPEEDS: list[tuple[str, float, float]] = [
    ("set_target_speed(20)", 20, 20),
    ("set_target_speed(90 / 3.6)", 25, 25),
    ("v = 20\nv += 5\nset_target_speed(v)", 25, 25),
    ("v = 20 if get_speed_of(ego) > 20 else 30\nset_target_speed(v)", 20, 30),
    ("set_target_speed(min(30, get_speed_of(ego) + 5))", -95, 30),
    ("set_target_speed(max(0, min(30, get_speed_of(ego))))", 0, 30),
    ("v = get_speed_of(ego)\nif v < 10:\n    v = 10\nset_target_speed(v)", 10, 100),
    ("v = get_speed_of(ego)\nif 5 < v <= 10:\n    set_target_speed(v)", math.nextafter(5, 6), 10),
    ("v = get_speed_of(ego)\nif not (v < 5 or v > 10):\n    set_target_speed(v)", 5, 10),
    ("n = 0\nwhile n < 30:\n    n = n + 1\n    yield autopilot()\nset_target_speed(n)", 30, 30),
    ("n = 30\nwhile n > 4:\n    n -= 3\n    yield autopilot()\nset_target_speed(n)", 2, 4),
    ("for v in [24, 23.5, 22]:\n    set_target_speed(v)\n    yield autopilot()", 22, 24),
    ("for v in range(10, 20):\n    set_target_speed(v)\n    yield autopilot()", 10, 19),
    ("v, w = 10, 20\nv, w = w, v\nset_target_speed(v)", 20, 20),
    ("try:\n    v = 10\n    int('x')\n    v = 20\nexcept ValueError:\n    set_target_speed(v)", 10, 20),
    ("def faster(by=2):\n    return 20 + by\nset_target_speed(faster() if ego else faster(9))", 22, 22),
    ("v = 10\ndef set_it():\n    nonlocal v\n    v = 15\nset_it()\nset_target_speed(v)", 15, 15),
    ("gap = lambda x: x + 1\nset_target_speed(gap(1))", 2, 2),
    ("v = 20.0 ** 2\nset_target_speed(v % 7)", 0, 7),
    ("state = 'a'\nif state == 'b':\n    state = 'c'\nset_target_speed(5 if state == 'a' else 50)", 5, 5),
]  # fmt: skip


@pytest.mark.parametrize(("text", "low", "high"), SPEEDS, ids=range(len(SPEEDS)))
def test_numbers_are_followed(text: str, low: float, high: float) -> None:
    source = body(text)
    assert check_source(source).passed
    value = argument(source)
    assert (value.lo, value.hi) == (pytest.approx(low), pytest.approx(high))
    assert not value.may_be_nan


def test_what_is_not_known_is_anything() -> None:
    for text in (
        "speeds = {'a': 20}\nset_target_speed(speeds['a'])",
        "v = 20\ndef change():\n    nonlocal v\n    v = 50\nf = change\nf()\nset_target_speed(v)",
        "def down(n):\n    return 20 if n < 1 else down(n - 1)\nset_target_speed(down(3))",
        "v = 20\ndef change():\n    nonlocal v\n    v = 50\nf = print\nif get_speed_of(ego) > 9:\n    f = change\nf()\n"
        "set_target_speed(v)",
        "best = max([1, 2], key=lambda v: set_target_speed(v))",
    ):
        value = argument(body(text))
        assert value.holds(20)
        assert value.holds(50)
        assert value.holds(None)


def test_nan_and_infinity_are_seen() -> None:
    nan = argument(body("v = math.inf\nset_target_speed(v - v)", "import math\n"))
    assert nan.may_be_nan
    assert argument(body("v = float(1e308) * 10\nset_target_speed(v)")).hi == math.inf
    assert argument(body("set_target_speed(25 / (get_speed_of(ego) + 200))")).hi == 0.25


def observation(index: int, lanes: int = 3, speed: float = 25.0) -> Observation:
    views = tuple(a_lane(f"a-b:{i}", ((0.0, 0.0), (1.0, 0.0))) for i in range(lanes))
    other = a_lane("b-c:0", ((0.0, 0.0), (1.0, 0.0)), limit=20.0)
    ego = VehicleState(0, "car", 0.0, 0.0, 0.0, speed, 5.0, 2.0, f"a-b:{index}")
    return Observation(0.0, 0, "highway", ego, (), (), a_road((*views, other)), None, None, False, False)


def test_circumstances_hold_until_the_first_yield() -> None:
    where = Circumstances.of(observation(0))
    assert (where.lanes, where.lane_index, where.speed_limits_mps) == (3, 0, (20.0, 30.0))
    now = argument(body("set_target_lane(get_left_lane(ego))"), "set_target_lane", where)
    assert now.is_none
    right = argument(body("set_target_lane(get_right_lane(ego))"), "set_target_lane", where)
    assert (right.offsets, right.may_be_none) == (frozenset({1}), False)
    later = argument(body("yield autopilot()\nset_target_lane(get_left_lane(ego))"), "set_target_lane", where)
    assert later.holds("lane:a-b:1")
    kept = argument(
        body("lane = get_right_lane(ego)\nyield autopilot()\nset_target_lane(lane)"), "set_target_lane", where
    )
    assert kept.offsets is None
    limit = argument(body("set_target_speed(get_speed_limit())"), where=where)
    assert (limit.lo, limit.hi) == (30.0, 30.0)
    limit = argument(body("yield autopilot()\nset_target_speed(get_speed_limit())"), where=where)
    assert (limit.lo, limit.hi) == (20.0, 30.0)
    speed = argument(body("set_target_speed(get_speed_of(ego))"), where=where)
    assert (speed.lo, speed.hi) == (24.0, 26.0)


LOOPS = [
    ("while True:\n    yield autopilot()", "yields", None),
    ("while get_speed_of(ego) > 3:\n    if is_safe_enter(None):\n        yield autopilot()", "unknown", None),
    ("while True:\n    for _ in range(3):\n        yield autopilot()", "yields", None),
    ("while True:\n    for car in [ego]:\n        break\n    if ego:\n        break\n    yield", "bounded", 1),
    ("n = 0\nwhile n < 8:\n    n += 2", "bounded", 5),
    ("n = 0.0\nwhile True:\n    n = n + 0.5\n    if n >= 2:\n        break", "bounded", 5),
    ("n = 9\nwhile n > 0:\n    n = n - 1 if n > 5 else n - 2", "bounded", 11),
    ("n = 0\nwhile n < 8:\n    if get_speed_of(ego) > 1:\n        n += 1\n    yield autopilot()", "yields", None),
    ("n = 0\nwhile n < 8:\n    if get_speed_of(ego) > 1:\n        n += 1", "unknown", None),
    ("for i in range(1000):\n    pass", "bounded", 1000),
    ("seen = [1, 2]\nfor one in seen:\n    pass", "bounded", None),
    ("seen, other = [1, 2], []\nfor one in seen:\n    other.append(one)", "bounded", None),
    ("seen = [1, 2]\nfor one in seen:\n    seen.append(one)", "unknown", None),
    ("seen = [1, 2]\nalso = seen\nfor one in seen:\n    also.append(one)", "unknown", None),
    ("while True:\n    set_target_speed(20)\n    if 1 > 2:\n        yield autopilot()", "endless", None),
    ("n = 0\ndef more():\n    nonlocal n\n    n += 1\n    return n\nwhile more() < 6:\n    yield", "yields", None),
    ("def hold():\n    yield autopilot()\nwhile True:\n    yield from hold()", "yields", None),
]  # fmt: skip


@pytest.mark.parametrize(("text", "verdict", "passes"), LOOPS, ids=range(len(LOOPS)))
def test_loops(text: str, verdict: str, passes: int | None) -> None:
    loop = verify(body(text)).loops[0]
    assert (loop.verdict, loop.passes) == (verdict, passes)
    assert loop.reason


def notes(text: str) -> list[tuple[int, str]]:
    return [(note.line, note.code) for note in verify(body(text)).notes]


def test_wishes_that_are_never_reached() -> None:
    report = verify(body("while True:\n    yield autopilot()\nset_target_speed(20)"))
    assert [note.line for note in report.notes] == [5]
    assert (
        report.notes[0].reason
        == "The wish set_target_speed is never reached: the loop in line 3 never comes to an end."
    )
    assert report.unreachable == (5, 6)
    assert [site.name for site in report.calls] == ["get_ego_vehicle", "autopilot"]
    report = verify(body("v = 20\nif v > 25:\n    set_target_speed(v)"))
    assert "the condition in line 4 is never true here" in report.notes[0].reason
    report = verify(body("pass", "def unused():\n    set_target_speed(20)\n\n"))
    assert report.notes[0].reason == "The wish set_target_speed is never reached: unused is never called."


def test_wishes_that_come_to_nothing() -> None:
    assert notes("set_target_speed(20)\nset_target_speed(25)") == [(3, "overwritten")]
    assert notes("set_desired_time_headway(1.0)\nset_desired_time_headway(2.0)") == [(3, "overwritten")]
    assert notes("set_target_speed(20)\nyield autopilot()\nset_target_speed(25)") == []
    assert notes("set_target_speed(20)\nif get_speed_of(ego) > 9:\n    set_target_speed(25)") == []
    assert notes("set_target_speed(20)\nset_target_speed(get_target_speed() + 1)") == []
    both = "if get_speed_of(ego) > 9:\n    set_target_speed(25)\nelse:\n    set_target_speed(15)"
    assert notes(f"set_target_speed(20)\n{both}") == [(3, "overwritten")]
    assert notes("for v in (20, 21):\n    set_target_speed(v)") == []


def test_lanes_to_both_sides() -> None:
    text = "set_target_lane(get_left_lane(ego))\nset_target_lane(get_right_lane(ego))"
    assert notes(text) == [(3, "overwritten"), (4, "both-sides")]
    assert notes(text.replace("\n", "\nyield autopilot()\n")) == []
    assert notes("set_target_lane(get_left_lane(ego))\nset_target_lane(get_lane_of(ego))") == [(3, "overwritten")]


def test_errors_that_a_program_catches_are_marked() -> None:
    report = verify(body("try:\n    set_target_speed(None)\nexcept TypeError:\n    set_target_speed(20)"))
    first, second = (site for site in report.calls if site.name == "set_target_speed")
    assert (first.guarded, first.arguments[0].value.is_none) == (True, True)
    assert (second.guarded, second.line) == (False, 6)


def test_flags_that_stand_for_not_none() -> None:
    near = "front = detect_front_vehicle_in(get_lane_of(ego))\nnear = front is not None and get_speed_of(ego) > 5\n"
    assert not argument(
        body(near + "if near:\n    v = get_lane_of(front)\n    set_target_lane(v)"), "set_target_lane"
    ).may_be_none
    report = verify(body(near + "if near:\n    get_distance_between_vehicles(front, ego)"))
    assert not report.calls[-2].arguments[0].value.may_be_none
    lost = (
        near
        + "front = detect_front_vehicle_in(get_lane_of(ego))\nif near:\n    get_distance_between_vehicles(front, ego)"
    )
    assert verify(body(lost)).calls[-2].arguments[0].value.may_be_none


def test_what_a_function_tested_holds_where_it_returned_true() -> None:
    head = (
        "def free(lane, decel=4.0):\n    if not is_safe_enter(lane, decel):\n        return False\n    return True\n\n"
    )
    waits = "lane = get_left_lane(ego)\nwhile not free(lane):\n    lane = get_left_lane(ego)\n    yield autopilot()\n"
    assert not argument(body(f"{waits}set_target_lane(lane)", head), "set_target_lane").may_be_none
    other = head.replace("if not is_safe", "lane = get_lane_of(get_ego_vehicle())\n    if not is_safe")
    assert argument(body(f"{waits}set_target_lane(lane)", other), "set_target_lane").may_be_none


def test_definitions_evaluate_their_defaults() -> None:
    report = verify(body("def late(x=detect_front_vehicle_in(get_lane_of(ego), 5 + 6)):\n    pass"))
    (site,) = [site for site in report.calls if site.name == "detect_front_vehicle_in"]
    assert site.argument("distance") == Value(8, 11, 11)
    assert not verify(body("def late(x: get_lane_of(ego)):\n    pass")).complete


def test_library_functions_are_followed() -> None:
    library = "def cruise(speed):\n    set_target_speed(speed + 1)\n    yield autopilot()\n"
    report = verify(body("yield from cruise(20)"), library)
    (site,) = [site for site in report.calls if site.name == "set_target_speed"]
    assert (site.in_library, site.line) == (True, 2)
    assert site.arguments[0].value.holds(21)
    assert not site.arguments[0].value.holds(22)


def test_recursion_is_taken_as_anything() -> None:
    head = "def down(n):\n    set_target_speed(n)\n    if n > 20:\n        yield from down(n - 1)\n    yield\n\n"
    value = argument(body("yield from down(25)", head))
    assert all(value.holds(n) for n in (25, 24, 20, -3))


def test_a_program_too_intricate_says_nothing() -> None:
    text = "".join(f"def f{n}(x):\n    return f{n + 1}(x) + f{n + 1}(x + 1)\n\n" for n in range(9))
    wide = "".join(
        f"def g{n}(x):\n" + "    x = " + " + ".join([f"g{n + 1}(x)"] * 12) + "\n    return x\n\n" for n in range(6)
    )
    source = body("set_target_speed(g0(1))", f"{text}def f9(x):\n    return x\n\n{wide}def g6(x):\n    return x\n\n")
    report = verify(source)
    assert not report.complete
    assert report.problem
    assert report.unreachable == ()
    (site,) = [site for site in report.calls if site.name == "set_target_speed"]
    assert site.arguments[0].value.holds(math.nan)


def test_what_is_no_program_raises() -> None:
    for text in ("def main(:", "x = 1", "def main():\n    return 1\n", "continue\ndef main():\n    yield\n"):
        with pytest.raises(ProgramSyntaxError):
            verify(text)
    with pytest.raises(ProgramSyntaxError, match="outside a loop"):
        verify("def main():\n    yield autopilot()\n    break\n")
