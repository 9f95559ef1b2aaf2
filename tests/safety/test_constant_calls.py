"""What static reading sees of a program, and what it must not pretend to see."""

from __future__ import annotations

import math
import time

import pytest

from chauffeur.safety.constant_calls import ApiUse, read_program


def values(source: str) -> list[float]:
    """All constants read for set_target_speed."""
    return [v for use in read_program(source).uses if use.name == "set_target_speed" for v in use.values]


def moves(source: str) -> list[int | None]:
    return [use.lane_offset for use in read_program(source).uses if use.name == "set_target_lane"]


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("30", 30.0), ("30.5", 30.5), ("-3", -3.0), ("+3", 3.0), ("- -3", 3.0), ("60/3.6", 60 / 3.6),
        ("10 + 20 * 2", 50.0),
        ("7 // 2", 3.0), ("7 % 4", 3.0), ("2 ** 5", 32.0), ("9 - 4", 5.0), ("float('inf')", math.inf),
        ("float(12)", 12.0),
        ("int(3.9)", 3.0), ("min(40, 35)", 35.0), ("max(40, 35)", 40.0), ("abs(-4)", 4.0), ("round(3.6)", 4.0),
        ("math.inf", math.inf), ("math.pi", math.pi), ("1e999", math.inf), ("10 ** 400", math.inf),
        ("9 ** 9 ** 9", math.inf),
        ("1" + "0" * 400, math.inf), ("target_speed=28", 28.0), ("(v := 31)", 31.0),
    ],
)  # fmt: skip
def test_constants(expression: str, expected: float) -> None:
    assert values(f"set_target_speed({expression})") == [expected]


def test_nan_is_read_as_nan() -> None:
    assert math.isnan(values("set_target_speed(float('nan'))")[0])


@pytest.mark.parametrize(
    "expression",
    ["x", "get_target_speed() + 5", "True", "'30'", "1 / 0", "(-8) ** 0.5", "float('fast')", "min()", "min(x, 30)",
     "not 3", "~3", "1 << 3", "math.tan", "math.inf(3)", "float(x=3)", "[3][0]", "round(3.5, 1.5)",
     "int(math.nan)", "*v", "", "1j"],
)  # fmt: skip
def test_what_is_no_constant_is_not_read(expression: str) -> None:
    assert values(f"set_target_speed({expression})") == []


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("V = 40\ndef f():\n    set_target_speed(V)", [40.0]),
        ("def f():\n    v: float = 40\n    set_target_speed(v)", [40.0]),
        ("v: float\nset_target_speed(v)", []),
        ("def f():\n    kmh = 120\n    v = kmh / 3.6\n    set_target_speed(v)", [120 / 3.6]),
        ("a, b = 10, 20\nset_target_speed(b)", [20.0]),
        ("[a, b] = [10, 20]\nset_target_speed(a)", [10.0]),
        ("a, *b = 10, 20\nset_target_speed(a)", []),
        ("a, b = f()\nset_target_speed(b)", []),
        ("a = b = 7\nset_target_speed(a)\nset_target_speed(b)", [7.0, 7.0]),
        ("V = 40\ndef f(V):\n    set_target_speed(V)", []),
        ("V = 40\ndef f():\n    V = 20\n    set_target_speed(V)", [20.0]),
        ("v = 1\nv = 2\nset_target_speed(v)", []),
        ("v = 1\nv += 2\nset_target_speed(v)", []),
        ("v = 1\nfor v in x: pass\nset_target_speed(v)", []),
        ("v = 1\nwith x as v: pass\nset_target_speed(v)", []),
        ("v = 1\ndel v\nset_target_speed(v)", []),
        ("v = 1\n[v for v in x]\nset_target_speed(v)", []),
        ("v = 1\nimport v\nset_target_speed(v)", []),
        ("v = 1\nimport v.w\nset_target_speed(v)", []),
        ("v = 1\nfrom x import y as v\nset_target_speed(v)", []),
        ("v = 1\nclass v: pass\nset_target_speed(v)", []),
        ("v = 1\ndef v(): pass\nset_target_speed(v)", []),
        ("v = 1\ntry: pass\nexcept E as v: pass\nset_target_speed(v)", []),
        ("v = 1\nmatch x:\n    case [y, *v]: pass\nset_target_speed(v)", []),
        ("v = 1\nmatch x:\n    case {'a': 1, **v}: pass\nset_target_speed(v)", []),
        ("v = 1\nmatch x:\n    case v: pass\nset_target_speed(v)", []),
        ("v = 1\ndef f():\n    global v\n    v = 2\ndef g():\n    set_target_speed(v)", []),
        ("a = b\nb = a\nset_target_speed(a)", []),
        ("if (v := 40) > x: pass\nset_target_speed(v)", [40.0]),
        ("v = 1\nif (v := 40) > x: pass\nset_target_speed(v)", []),
        ("b = 5\na, *b = 10, 20\nset_target_speed(b)", []),
        ("x.v = 3\nv = 4\nset_target_speed(v)", [4.0]),
        ("set_target_speed(30 if x else 50)", [30.0, 50.0]),
        ("set_target_speed(2 * (30 if x else 50))", [60.0, 100.0]),
        ("set_target_speed(30 if x else y)", [30.0]),
        ("go = set_target_speed\ngo(99)", [99.0]),
        ("def f():\n    set_target_speed(9)\n    yield\n(lambda: set_target_speed(8))()", [9.0, 8.0]),
    ],
)  # fmt: skip
def test_names_bound_once_are_followed(source: str, expected: list[float]) -> None:
    assert values(source) == expected


def test_calls_come_in_source_order_with_their_lines() -> None:
    uses = read_program("def f():\n    b(2); a(1)\n    c()\nd(e=4)\nx.y(3)\n(lambda: 0)()").uses
    assert [(use.name, use.line) for use in uses] == [("b", 2), ("a", 2), ("c", 3), ("d", 4)]
    assert uses[0] == ApiUse("b", 2, (2.0,), None, uses[0].function)
    assert uses[0].function == uses[1].function == uses[2].function != uses[3].function


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("set_target_lane(get_left_lane(get_ego_vehicle()))", [-1]),
        ("ego = get_ego_vehicle()\nleft = get_left_lane(ego)\nset_target_lane(left)", [-1]),
        ("ego = get_ego_vehicle()\nset_target_lane(target_lane=get_right_lane(veh=ego))", [1]),
        ("set_target_lane(get_left_lane())", [-1]),
        ("set_target_lane(get_right_lane(None))", [1]),
        ("ego = get_ego_vehicle()\nset_target_lane(get_lane_of(ego))", [0]),
        ("def f():\n    beside = get_left_lane\n    set_target_lane(beside())", [-1]),
        ("def f():\n    me = get_ego_vehicle\n    set_target_lane(get_right_lane(me()))", [1]),
        ("set_target_lane(get_left_lane(front))", [None]),
        ("set_target_lane(get_left_lane(detect_front_vehicle_in(None)))", [None]),
        ("set_target_lane(lane)", [None]),
        ("set_target_lane(other())", [None]),
        ("set_target_lane(x.y())", [None]),
        ("set_target_lane()", [None]),
    ],
)
def test_lanes_beside_the_ego(source: str, expected: list[int | None]) -> None:
    assert moves(source) == expected


@pytest.mark.parametrize(
    ("source", "tested"),
    [
        ("if left is None: return", True), ("if left is not None: pass", True), ("if None == left: pass", True),
        ("if left: pass", True), ("while left: pass", True), ("x = 1 if left else 2", True), ("assert left", True),
        ("x = not left", True), ("x = left and y", True), ("if (l := left) is None: pass", True),
        ("if left == 3: pass", False), ("if 3 == left: pass", False), ("if right: pass", False), ("pass", False),
        ("if is_safe_enter(left): go()", False),
        ("while not is_safe_enter(left): yield", False),
        ("if is_safe_enter(left): go()\nelse: yield", False),
        ("if is_safe_enter(left): go()\nelif y: set_target_lane(right)", True),
        ("def f():\n  safe = is_safe_enter\n  if safe(left): go()\n  elif y: set_target_lane(right)", True),
        ("def f():\n  go = set_target_lane\n  if is_safe_enter(left): pass\n  else: go(right)", True),
        ("if is_safe_enter(): go()\nelse: set_target_lane(right)", False),
        ("if y: go()\nelse: set_target_lane(right)", False),
    ],
)  # fmt: skip
def test_sides_tested_before_use(source: str, tested: bool) -> None:
    reading = read_program(f"left = get_left_lane()\n{source}")
    assert (-1 in reading.sides_tested) is tested


@pytest.mark.parametrize("source", ["def (", "\x00", "x = " + "(" * 300 + ")" * 300, " " * 100_001])
def test_what_cannot_be_parsed_reads_as_nothing(source: str) -> None:
    assert read_program(source).uses == ()


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("-v", [-20.0]), ("+v", [20.0]), ("v if x else 50", [20.0, 50.0]), ("50 if x else v", [50.0, 20.0]),
        ("v * 2", [40.0]), ("2 * v", [40.0]), ("max(v, 10)", [20.0]), ("max(10, v)", [20.0]), ("abs(-v)", [20.0]),
        ("1 / (0 if x else 2)", [0.5]),  # what fails on one way does not hide the other
    ],
)  # fmt: skip
def test_names_are_followed_within_sums(expression: str, expected: list[float]) -> None:
    assert values(f"def f():\n    v = 20\n    set_target_speed({expression})") == expected


def test_a_hundred_thousand_characters_are_read_and_no_more() -> None:
    source = "set_target_speed(9)"
    assert values(source.ljust(100_000)) == [9.0]
    assert values(source.ljust(100_001)) == []


def test_forty_levels_are_read_and_no_more() -> None:
    assert values(f"set_target_speed({'-' * 40}1)") == [1.0]
    assert values(f"set_target_speed({'-' * 41}1)") == []


@pytest.mark.parametrize(("levels", "expected"), [(14, [2.0**14]), (15, []), (18, [])])
def test_fifty_thousand_steps_are_made_for_all_numbers_together(levels: int, expected: list[float]) -> None:
    """Names used twice, level upon level: two steps more than twice as many on each."""
    doubling = "a0 = 1\n" + "".join(f"a{i + 1} = a{i} + a{i}\n" for i in range(levels))
    assert values(f"{doubling}set_target_speed(a{levels})") == expected
    twice = values(f"{doubling}set_target_speed(a{levels})\nset_target_speed(a{levels})")
    assert twice == expected, "nothing is left for the second"


@pytest.mark.parametrize(("deeds", "tested"), [(12_000, True), (17_000, False)])
def test_fifty_thousand_steps_are_made_in_looking_for_another_lane(deeds: int, tested: bool) -> None:
    source = f"left = get_left_lane()\nif is_safe_enter(left): pass\nelse:\n    {'y;' * deeds}set_target_lane(left)"
    assert (-1 in read_program(source).sides_tested) is tested


def test_deep_and_doubling_programs_cost_little() -> None:
    doubling = (
        "a0 = 1 if x else 2\n" + "".join(f"a{i + 1} = a{i} + a{i}\n" for i in range(60)) + "set_target_speed(a60)"
    )
    chain = "set_target_speed(" + "+".join(["1"] * 900) + ")"
    elifs = "if is_safe_enter(left): pass\n" + "elif is_safe_enter(left): pass\n" * 900 + "else: pass"
    start = time.perf_counter()
    assert values(doubling) == []
    assert values(chain) == []
    assert read_program(elifs).sides_tested == frozenset()
    assert time.perf_counter() - start < 5.0


def test_reading_a_program_says_nothing_on_the_error_channel(recwarn: pytest.WarningsRecorder) -> None:
    assert read_program("def main():\n    x = '\\d' if 5is 5 else 3\n    say(str(x))\n").uses
    assert not recwarn.list
