"""Random programs of the driving language, for property tests of the verifier.

Before every statement stands `say("@n")`, so that a run tells which statements it came by, and which of them made a
call. No program is meant to make sense; most do not fail at once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from hypothesis import strategies as st

NUMBERS = ("a", "b", "c")
NAMES = (*NUMBERS, "shared")
LANES = ("left", "right", "here")
CARS = ("front", "rear")
SMALL = (
    "seen.append(a)",
    "flag = not flag",
    "flag = front is not None and get_speed_of(ego) > a",
    "flag = left is not None or a < b",
    "state = 'one'",
    "state = 'two'",
    "pair = (a, b)",
    "a, b = pair",
    "a, b = b, a",
    "later = bump",
    "later = bump",
    "later()",
    "later()",
    "seen.sort(key=lambda x: bump() or -x)",
    "seen = [x + a for x in seen if x > b]",
    "c = (lambda x: set_target_speed(x + a))(b)",
    "a = sum(x for x in (a, b) if x)",
)


@dataclass
class Writer:
    """Writes one program; `pick` chooses among alternatives."""

    pick: Callable[[Any], Any]
    lines: list[str] = field(default_factory=list)
    marks: int = 0
    budget: int = 26

    def chance(self, percent: int) -> bool:
        return self.pick(st.integers(0, 99)) < percent

    def one_of(self, *options: str) -> str:
        return self.pick(st.sampled_from(options))

    def number(self) -> str:
        if self.chance(50):
            return str(self.pick(st.integers(-3, 45)))
        return repr(self.pick(st.sampled_from((0.0, 0.1, 0.5, -1.5, 2.5, 9.75, 20.0, 31.25, 1e3, 1e-3))))

    def value(self, depth: int = 2) -> str:
        kind = self.pick(st.integers(0, 13 if depth else 3))
        if kind <= 1:
            return self.number()
        if kind <= 3:
            return self.one_of(*NAMES)
        if kind <= 6:
            op = self.one_of("+", "-", "*", "+", "-", "/", "//", "%")
            return f"({self.value(depth - 1)} {op} {self.value(depth - 1)})"
        if kind == 7:
            return f"{self.one_of('min', 'max')}({self.value(depth - 1)}, {self.value(depth - 1)})"
        if kind == 8:
            return f"({self.value(depth - 1)} if {self.test(depth - 1)} else {self.value(depth - 1)})"
        if kind == 9:
            function = self.one_of("abs", "round", "int", "float", "-", "math.floor", "math.sqrt")
            return f"{function}({self.value(depth - 1)})"
        if kind == 10:
            return f"helper({self.value(depth - 1)}, {self.value(depth - 1)})"
        if kind == 11:
            return f"({self.value(depth - 1)} ** {self.one_of('2', '3', '0.5', '0.25', '-1')})"
        if kind == 12:
            return self.one_of("twice(a)", "twice(b)", "len(seen)", "(c := a + 1)", "pair[0]", "sum(seen)")
        return self.one_of(
            "get_speed_of(ego)",
            "get_target_speed()",
            "get_desired_time_headway()",
            "get_speed_limit()",
            "detect_stop_sign_ahead()",
            "get_distance_between_vehicles(front or ego, ego)",
            "get_speed_of(front if front is not None else ego)",
        )

    def test(self, depth: int = 2) -> str:
        kind = self.pick(st.integers(0, 9 if depth else 3))
        if kind <= 2:
            op = self.one_of("<", "<=", ">", ">=", "==", "!=")
            return f"{self.value(max(0, depth - 1))} {op} {self.value(max(0, depth - 1))}"
        if kind == 3:
            return self.one_of("a", "flag", "not flag", "seen", "state == 'one'", "state != 'two'", "front", "True")
        if kind == 4:
            name = self.one_of(*LANES, *CARS)
            return f"{name} {self.one_of('is', 'is not', '==', '!=')} None"
        if kind == 5:
            return f"is_safe_enter({self.one_of(*LANES)}, {self.one_of('5.0', 'a', 'abs(b)')})"
        if kind == 6:
            return f"not ({self.test(depth - 1)})"
        if kind == 7:
            return f"{self.number()} < {self.one_of(*NAMES)} <= {self.value(depth - 1)}"
        if kind == 8:
            return f"{self.one_of(*LANES)} == get_lane_of(ego)"
        return f"({self.test(depth - 1)} {self.one_of('and', 'or')} {self.test(depth - 1)})"

    def put(self, indent: int, text: str) -> None:
        self.lines.append(" " * 4 * indent + text)

    def mark(self, indent: int) -> None:
        self.put(indent, f'say("@{self.marks}")')
        self.marks += 1

    def block(self, indent: int, *, loop: bool, drives: bool) -> None:
        for _ in range(self.pick(st.integers(1, 3))):
            self.statement(indent, loop=loop, drives=drives)

    def statement(self, indent: int, *, loop: bool, drives: bool) -> None:
        self.budget -= 1
        self.mark(indent)
        compound = self.budget > 0 and indent < 5
        kind = self.pick(st.integers(0, 23 if compound else 12))
        if kind <= 3:
            self.put(indent, f"{self.one_of(*NUMBERS)} = {self.value()}")
        elif kind == 4:
            self.put(indent, f"{self.one_of(*NUMBERS)} {self.one_of('+', '-', '*')}= {self.value(1)}")
        elif kind <= 6:
            self.put(indent, f"set_target_speed({self.value()})")
        elif kind == 7:
            self.put(indent, f"set_desired_time_headway({self.value(1)})")
        elif kind == 8:
            self.put(indent, self.one_of(*(f"set_target_lane({lane})" for lane in LANES), "bump()", "pass"))
        elif kind == 9:
            self.put(indent, self.look())
        elif kind == 10 and drives:
            self.put(indent, "yield autopilot()")
        elif kind == 11:
            self.put(indent, self.one_of(*SMALL))
        elif kind == 12:
            ways = (
                *(("break", "continue") if loop else ()),
                "return" if drives else "return a",
                "raise ValueError('no')",
            )
            self.put(indent, self.one_of(*ways) if self.chance(40) else "pass")
        elif kind <= 16:
            self.put(indent, f"if {self.test()}:")
            self.block(indent + 1, loop=loop, drives=drives)
            if self.chance(50):
                self.put(indent, "else:")
                self.block(indent + 1, loop=loop, drives=drives)
        elif kind <= 21:
            self.loop(indent, drives=drives)
        else:
            self.put(indent, "try:")
            self.block(indent + 1, loop=loop, drives=drives)
            if self.chance(70):
                self.put(indent, f"except {self.one_of('ValueError', 'Exception', 'ZeroDivisionError as error')}:")
                self.block(indent + 1, loop=loop, drives=drives)
                if self.chance(25):
                    self.put(indent, "else:")
                    self.block(indent + 1, loop=loop, drives=drives)
            else:
                self.put(indent, "finally:")
                self.block(indent + 1, loop=False, drives=drives)

    def look(self) -> str:
        return self.one_of(
            "front = detect_front_vehicle_in(get_lane_of(ego))",
            f"front = detect_front_vehicle_in(here, {self.value(1)})",
            "rear = detect_rear_vehicle_in(left)",
            "left = get_left_lane(ego)",
            "right = get_right_lane(ego)",
            "here = get_lane_of(ego)",
            "left = right",
            "here = left if left is not None else right",
        )

    def loop(self, indent: int, *, drives: bool) -> None:
        kind = self.pick(st.integers(0, 5))
        if kind == 0:
            self.put(
                indent, f"for {self.one_of(*NUMBERS)} in range({self.one_of('3', '1, 5', 'int(a) % 4', '6, 1, -2')}):"
            )
        elif kind == 1:
            self.put(indent, f"for {self.one_of(*NUMBERS)} in ({self.number()}, {self.number()}):")
        elif kind == 2:
            self.put(indent, f"for {self.one_of(*NUMBERS)} in seen:")
        elif kind == 3:
            self.put(indent, f"while {self.one_of(*NUMBERS)} < {self.number()}:")
        else:
            self.put(indent, f"while {self.test()}:")
        if kind >= 3 and self.chance(60):
            self.mark(indent + 1)
            self.put(indent + 1, f"{self.one_of(*NUMBERS)} += {self.one_of('1', '0.5', '2', '-1')}")
        self.block(indent + 1, loop=True, drives=drives)
        if drives and self.chance(60):
            self.mark(indent + 1)
            self.put(indent + 1, "yield autopilot()")
        if self.chance(15):
            self.put(indent, "else:")
            self.block(indent + 1, loop=False, drives=drives)


HEAD = """import math

shared = 0

def helper(a, b=2):
    c, flag, state, seen, pair = 1, False, "one", [], (a, b)
    ego = get_ego_vehicle()
    left, right, here = get_left_lane(ego), get_right_lane(ego), get_lane_of(ego)
    front, rear = detect_front_vehicle_in(here), None
    later = print
    twice = lambda x: x * 2
    def bump():
        nonlocal c
        c += 1
"""
"""How the plain helper begins."""

SETUP = """    a, b, c, flag, state, seen, pair = 1, 2.0, 0, False, "one", [], (3, 4.5)
    ego = get_ego_vehicle()
    left, right, here = get_left_lane(ego), get_right_lane(ego), get_lane_of(ego)
    front, rear = detect_front_vehicle_in(here), None
    later = print
    twice = lambda x: x + x
    def bump():
        global shared
        nonlocal a
        a = a + shared
        shared = shared + 1
"""


@st.composite
def programs(draw: Callable[[Any], Any]) -> str:
    """A program of the language."""
    writer = Writer(draw)
    writer.lines = HEAD.splitlines()
    writer.budget = 5
    writer.block(1, loop=False, drives=False)
    writer.put(1, "return a")
    writer.put(0, "")
    writer.put(0, "def wait(a):")
    writer.lines += SETUP.replace("a, b, c, flag", "b, c, flag").replace("= 1, 2.0, 0", "= 2.0, 0").splitlines()
    writer.budget = 6
    writer.block(1, loop=False, drives=True)
    writer.put(1, "yield autopilot()")
    writer.put(1, "return c")
    writer.put(0, "")
    writer.put(0, "def main():")
    writer.lines += SETUP.splitlines()
    writer.budget = 24
    for _ in range(draw(st.integers(2, 5))):
        writer.statement(1, loop=False, drives=True)
        if writer.chance(20):
            writer.mark(1)
            writer.put(1, f"b = yield from wait({writer.value(1)})")
    writer.put(1, "yield autopilot()")
    return "\n".join(writer.lines) + "\n"
