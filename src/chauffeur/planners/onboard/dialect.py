"""The dialect the on-board model writes: short programs over skills, one call a thing to do.

A skill is a function of a library that comes with the program (`link`). The model's text keeps numbers and units as the
passenger said them, so that it never has to calculate: `slower_by(mph(10))`, `gap_of(0.85 * 30)`. Every text of the
dialect is a program of the driving language; what is not of the dialect is refused here, whoever wrote it.

    def drive():
        yield from wait(10)
        while not lead_closer_than(feet(100)):
            yield autopilot()
        yield from overtake_left()
"""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

from chauffeur.concept import ProgramError
from chauffeur.concept.units import M_PER_CAR_LENGTH, M_PER_FOOT, M_PER_YARD, MPS_PER_KMH, MPS_PER_MPH
from chauffeur.planners.onboard.meaning import BIT, MUCH, PLAIN, Amount, Meaning

Kind = Literal["speed", "distance", "time", "factor", "lanes"]

UNITS: Final[Mapping[str, tuple[Kind, float, str]]] = {
    "mph": ("speed", MPS_PER_MPH, "mph"),
    "kmh": ("speed", MPS_PER_KMH, "km/h"),
    "feet": ("distance", M_PER_FOOT, "feet"),
    "yards": ("distance", M_PER_YARD, "yards"),
    "car_lengths": ("distance", M_PER_CAR_LENGTH, "car lengths"),
}
"""Unit functions: what they measure, their SI value, and how they are said."""

SI: Final[Mapping[Kind, str]] = {"speed": "m/s", "distance": "m", "time": "s", "factor": "times", "lanes": "lanes"}

MANNERS: Final[Mapping[str, str]] = {"gently": "gentle", "quickly": "swift"}
"""A last argument that says how, and what it is in a meaning."""

MAX_STEPS: Final = 3
MAX_CHARS: Final = 600


@dataclass(frozen=True, slots=True)
class Skill:
    """A thing to do.

    Attributes:
        name: Function name.
        meaning: What it means, without the number.
        takes: What its number measures; None for no number.
        says: How the model tells it, after "I"; `{n}` is the number as said.
    """

    name: str
    meaning: Meaning
    says: str
    takes: Kind | None = None


def _speed(change: Literal[-1, 0, 1] = 0, degree: float = PLAIN, **more: object) -> Meaning:
    return replace(Meaning("speed", change=change, degree=degree), **more)  # type: ignore[arg-type]


def _gap(change: Literal[-1, 0, 1] = 0, degree: float = PLAIN, **more: object) -> Meaning:
    return replace(Meaning("gap", change=change, degree=degree), **more)  # type: ignore[arg-type]


def _amount(dimension: str, frame: str = "absolute", bound: str = "exact") -> Amount:
    return Amount(0.0, dimension, frame, bound)  # type: ignore[arg-type]


_TABLE: Final[tuple[Skill, ...]] = (
    Skill("drive_at", _speed(amount=_amount("speed")), "drive at {n}", "speed"),
    Skill("faster_by", _speed(1, amount=_amount("speed", "relative")), "drive {n} faster", "speed"),
    Skill("slower_by", _speed(-1, amount=_amount("speed", "relative")), "drive {n} slower", "speed"),
    Skill("faster", _speed(1), "drive faster"),
    Skill("a_bit_faster", _speed(1, BIT), "drive a bit faster"),
    Skill("much_faster", _speed(1, MUCH), "drive much faster"),
    Skill("slower", _speed(-1), "drive slower"),
    Skill("a_bit_slower", _speed(-1, BIT), "drive a bit slower"),
    Skill("much_slower", _speed(-1, MUCH), "drive much slower"),
    Skill("at_most", _speed(amount=_amount("speed", bound="at_most")), "stay at or below {n}", "speed"),
    Skill("at_least", _speed(amount=_amount("speed", bound="at_least")), "stay at or above {n}", "speed"),
    Skill("drive_at_limit", _speed(variant="limit"), "drive at the speed limit"),
    Skill(
        "over_limit_by",
        _speed(variant="limit", amount=_amount("speed", "over_limit")),
        "drive {n} above the limit",
        "speed",
    ),
    Skill(
        "under_limit_by",
        _speed(variant="limit", amount=_amount("speed", "over_limit")),
        "drive {n} below the limit",
        "speed",
    ),
    Skill("as_fast_as_allowed", _speed(variant="max"), "drive as fast as is allowed"),
    Skill("match_traffic", _speed(variant="match"), "drive as fast as the traffic"),
    Skill("speed_times", _speed(amount=_amount("share", "factor")), "drive at {n} our speed", "factor"),
    Skill("hold_speed", _speed(variant="hold"), "hold our speed"),
    Skill("gap_of", _gap(amount=_amount("distance")), "keep {n} to the vehicle ahead", "distance"),
    Skill("closer_by", _gap(-1, amount=_amount("distance", "relative")), "close up by {n}", "distance"),
    Skill("further_by", _gap(1, amount=_amount("distance", "relative")), "drop back by {n}", "distance"),
    Skill("closer", _gap(-1), "close up"),
    Skill("a_bit_closer", _gap(-1, BIT), "close up a bit"),
    Skill("much_closer", _gap(-1, MUCH), "close up a lot"),
    Skill("further", _gap(1), "drop back"),
    Skill("a_bit_further", _gap(1, BIT), "drop back a bit"),
    Skill("much_further", _gap(1, MUCH), "drop back a lot"),
    Skill("gap_of_seconds", _gap(amount=_amount("time")), "stay {n} behind the vehicle ahead", "time"),
    Skill("gap_at_least", _gap(amount=_amount("distance", bound="at_least")), "never get closer than {n}", "distance"),
    Skill("gap_at_most", _gap(amount=_amount("distance", bound="at_most")), "stay within {n}", "distance"),
    Skill("gap_times", _gap(amount=_amount("share", "factor")), "make the gap {n} what it is", "factor"),
    Skill("hold_gap", _gap(variant="hold"), "keep the gap as it is"),
    Skill("lane_left", Meaning("lane", "left"), "change to the left lane"),
    Skill("lane_right", Meaning("lane", "right"), "change to the right lane"),
    Skill("change_lane", Meaning("lane"), "change to the other lane"),
    Skill("lanes_left", Meaning("lane", "left", amount=_amount("lanes")), "move {n} to the left", "lanes"),
    Skill("lanes_right", Meaning("lane", "right", amount=_amount("lanes")), "move {n} to the right", "lanes"),
    Skill("leftmost_lane", Meaning("lane", "left", variant="edge"), "move to the leftmost lane"),
    Skill("rightmost_lane", Meaning("lane", "right", variant="edge"), "move to the rightmost lane"),
    Skill("middle_lane", Meaning("lane", variant="middle"), "move to the middle lane"),
    Skill("keep_lane", Meaning("lane", variant="hold"), "stay in this lane"),
    Skill("back_on_the_road", Meaning("lane", variant="return"), "go back on the road"),
    Skill("lane_left_patiently", Meaning("lane", "left", condition="safe"), "change to the left lane when it is clear"),
    Skill(
        "lane_right_patiently", Meaning("lane", "right", condition="safe"), "change to the right lane when it is clear"
    ),
    Skill("overtake", Meaning("overtake"), "overtake"),
    Skill("overtake_left", Meaning("overtake", "left"), "overtake on the left"),
    Skill("overtake_right", Meaning("overtake", "right"), "overtake on the right"),
    Skill("overtake_and_return", Meaning("overtake", variant="return"), "overtake and come back"),
    Skill("overtake_left_and_return", Meaning("overtake", "left", variant="return"), "overtake left and come back"),
    Skill("overtake_right_and_return", Meaning("overtake", "right", variant="return"), "overtake right and come back"),
    Skill("turn_left", Meaning("turn", "left"), "turn left at the junction"),
    Skill("turn_right", Meaning("turn", "right"), "turn right at the junction"),
    Skill("go_straight", Meaning("turn", "straight"), "go straight on at the junction"),
    Skill("pull_over", Meaning("pull_over"), "pull over and stop"),
    Skill("stop_here", Meaning("stop"), "stop in our lane"),
    Skill("follow", Meaning("follow"), "follow the vehicle ahead"),
    Skill("no_overtaking", Meaning("follow", variant="no overtaking"), "overtake nobody"),
    Skill("let_in", Meaning("yield"), "let the others go first"),
    Skill("carry_on", Meaning("keep"), "change nothing"),
    Skill("drive_normally", Meaning("resume"), "drive normally"),
    Skill("hurry", Meaning("style", variant="hurry"), "hurry within what is allowed"),
    Skill("relax", Meaning("style", variant="relax"), "drive relaxed"),
    Skill("gently", Meaning("style", variant="comfort"), "drive gently"),
    Skill("carefully", Meaning("style", variant="careful"), "drive carefully"),
    Skill("sportily", Meaning("style", variant="sporty"), "drive in a sporty way"),
    Skill("economically", Meaning("style", variant="eco"), "save energy"),
)

SKILLS: Final[Mapping[str, Skill]] = {skill.name: skill for skill in _TABLE}
"""By name."""

CONDITIONS: Final[Mapping[str, tuple[Kind | None, str]]] = {
    "lead_slower_than": ("speed", "the vehicle ahead is slower than {n}"),
    "lead_closer_than": ("distance", "the vehicle ahead is closer than {n}"),
    "lead_further_than": ("distance", "the vehicle ahead is further away than {n}"),
    "clear_left": (None, "the left lane is clear"),
    "clear_right": (None, "the right lane is clear"),
}
"""Conditions a step may wait for or depend on: what the number measures, and the words."""


@dataclass(frozen=True, slots=True)
class Number:
    """A number as said.

    Attributes:
        value: In its unit.
        unit: Unit function, or empty for SI.
        factor: What it is multiplied with: a share of a number of the history.
    """

    value: float
    unit: str = ""
    factor: float = 1.0

    @property
    def si(self) -> float:
        """Its value in SI units."""
        return self.value * self.factor * (UNITS[self.unit][1] if self.unit else 1.0)

    def text(self) -> str:
        """As the program writes it."""
        written = plain(self.value)
        inner = f"{self.unit}({written})" if self.unit else written
        return inner if self.factor == 1.0 else f"{plain(self.factor)} * {inner}"

    def said(self, kind: Kind) -> str:
        """As the model tells it."""
        unit = UNITS[self.unit][2] if self.unit else SI[kind]
        text = f"{plain(self.value)} {unit}"
        return text if self.factor == 1.0 else f"{plain(self.factor)} times {text}"


@dataclass(frozen=True, slots=True)
class StepCondition:
    """Condition of a step: `if` is looked at once, `once` is waited for."""

    how: Literal["if", "once"]
    name: str
    number: Number | None = None


@dataclass(frozen=True, slots=True)
class DialectStep:
    """One thing to do.

    Attributes:
        skill: Name of the skill.
        number: Its number.
        manner: `gently`, `quickly` or empty.
        wait_s: Seconds to wait before it.
        condition: What it depends on.
    """

    skill: str
    number: Number | None = None
    manner: str = ""
    wait_s: Number | None = None
    condition: StepCondition | None = None

    @property
    def meaning(self) -> Meaning:
        """The meaning, with the number."""
        skill = SKILLS[self.skill]
        meaning = replace(skill.meaning, manner=MANNERS.get(self.manner, ""))
        if skill.takes is None or self.number is None or meaning.amount is None:
            return meaning
        value = -self.number.si if self.skill == "under_limit_by" else self.number.si
        amount = replace(meaning.amount, value=value, said=self.number.said(skill.takes))
        change = (1 if value > 1.0 else -1 if value < 1.0 else 0) if amount.frame == "factor" else meaning.change
        return replace(meaning, amount=amount, change=change)

    @property
    def numbers(self) -> tuple[Number, ...]:
        """All its numbers: of the skill, the wait and the condition."""
        tested = None if self.condition is None else self.condition.number
        return tuple(number for number in (self.number, self.wait_s, tested) if number is not None)

    def call(self) -> str:
        """The call as the program writes it."""
        arguments = [] if self.number is None else [self.number.text()]
        return f"{self.skill}({', '.join([*arguments, *([repr(self.manner)] if self.manner else [])])})".replace(
            "'", '"'
        )


def plain(value: float) -> str:
    """A number without needless digits: `45`, `2.5`."""
    return f"{value:.6f}".rstrip("0").rstrip(".")


def write(steps: Sequence[DialectStep]) -> str:
    """The program of some steps."""
    lines = ["def drive():"]
    for step in steps:
        if step.wait_s is not None:
            lines.append(f"    yield from wait({step.wait_s.text()})")
        indent = "    "
        if step.condition is not None:
            number = step.condition.number
            test = f"{step.condition.name}({'' if number is None else number.text()})"
            if step.condition.how == "if":
                lines.append(f"    if {test}:")
                indent = "        "
            else:
                lines += [f"    while not {test}:", "        yield autopilot()"]
        lines.append(f"{indent}yield from {step.call()}")
    return "\n".join(lines) + "\n"


def tell(steps: Sequence[DialectStep]) -> str:
    """The program of some steps in one sentence: the same numbers in the same units."""
    parts: list[str] = []
    for step in steps:
        skill = SKILLS[step.skill]
        words = skill.says.format(n="" if step.number is None or skill.takes is None else step.number.said(skill.takes))
        if step.manner:
            words += f" {step.manner}"
        if step.condition is not None:
            kind, test = CONDITIONS[step.condition.name]
            number = step.condition.number
            words += f" {step.condition.how} " + test.format(
                n="" if number is None or kind is None else number.said(kind)
            )
        if step.wait_s is not None:
            words = f"wait {step.wait_s.said('time')} and {words}"
        parts.append(words)
    return f"I {', then I '.join(parts)}."


def shall_i(steps: Sequence[DialectStep]) -> str:
    """The question whether to do what some steps do."""
    guess = tell(steps).removeprefix("I ").removesuffix(".").replace(", then I ", ", then ")
    return f"Shall I {guess}?"


def read(source: str) -> tuple[DialectStep, ...]:
    """The steps of a program of the dialect.

    Raises:
        ProgramError: It is not of the dialect; says where.
    """
    if len(source) > MAX_CHARS:
        raise ProgramError(f"A program of the dialect has at most {MAX_CHARS} characters.")
    try:
        body = ast.parse(source).body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise ProgramError(f"Not a program: {error}.") from None
    if len(body) != 1 or not isinstance(body[0], ast.FunctionDef) or body[0].name != "drive" or _has_arguments(body[0]):
        raise ProgramError("A program of the dialect is one function drive().")
    steps: list[DialectStep] = []
    wait: Number | None = None
    once: StepCondition | None = None
    for statement in body[0].body:
        if once is None and wait is None and (found := _delegated(statement, "wait")) is not None:
            wait = _number(_only(found), "time", statement)
        elif once is None and isinstance(statement, ast.While) and not statement.orelse:
            once = _awaited(statement)
        elif once is None and isinstance(statement, ast.If) and not statement.orelse and len(statement.body) == 1:
            step = _step(statement.body[0])
            steps.append(replace(step, wait_s=wait, condition=_condition("if", statement.test)))
            wait = None
        else:
            steps.append(replace(_step(statement), wait_s=wait, condition=once))
            wait = once = None
    if wait is not None or once is not None or not 1 <= len(steps) <= MAX_STEPS:
        raise ProgramError(f"A program of the dialect does one to {MAX_STEPS} things.")
    return tuple(steps)


def _has_arguments(function: ast.FunctionDef) -> bool:
    args = function.args
    return bool(
        args.args or args.posonlyargs or args.kwonlyargs or args.vararg or args.kwarg or function.decorator_list
    )


def _delegated(statement: ast.stmt, name: str = "") -> ast.Call | None:
    """The call of `yield from call(...)`, if a statement is one (of that name)."""
    if not isinstance(statement, ast.Expr) or not isinstance(statement.value, ast.YieldFrom):
        return None
    call = statement.value.value
    if not isinstance(call, ast.Call) or not isinstance(call.func, ast.Name) or call.keywords:
        return None
    return call if name in ("", call.func.id) else None


def _step(statement: ast.stmt) -> DialectStep:
    call = _delegated(statement)
    if call is None or not isinstance(call.func, ast.Name) or call.func.id not in SKILLS:
        raise _not_of_it(statement)
    skill = SKILLS[call.func.id]
    arguments = list(call.args)
    manner = ""
    if arguments and isinstance(arguments[-1], ast.Constant) and arguments[-1].value in MANNERS:
        manner = str(ast.literal_eval(arguments.pop()))
    if skill.takes is None:
        if arguments:
            raise _not_of_it(statement)
        return DialectStep(skill.name, manner=manner)
    if len(arguments) != 1:
        raise _not_of_it(statement)
    return DialectStep(skill.name, _number(arguments[0], skill.takes, statement), manner)


def _awaited(loop: ast.While) -> StepCondition:
    test = loop.test
    waits = len(loop.body) == 1 and ast.unparse(loop.body[0]) in ("yield autopilot()", "(yield autopilot())")
    if not waits or not isinstance(test, ast.UnaryOp) or not isinstance(test.op, ast.Not):
        raise _not_of_it(loop)
    return _condition("once", test.operand)


def _condition(how: Literal["if", "once"], test: ast.expr) -> StepCondition:
    if not isinstance(test, ast.Call) or not isinstance(test.func, ast.Name) or test.keywords:
        raise _not_of_it(test)
    name = test.func.id
    if name not in CONDITIONS:
        raise _not_of_it(test)
    kind = CONDITIONS[name][0]
    if kind is None:
        if test.args:
            raise _not_of_it(test)
        return StepCondition(how, name)
    return StepCondition(how, name, _number(_only(test), kind, test))


def _only(call: ast.Call) -> ast.expr:
    if len(call.args) != 1:
        raise _not_of_it(call)
    return call.args[0]


def _number(node: ast.expr, kind: Kind, at: ast.AST) -> Number:
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult):
        factor = _literal(node.left, at)
        return replace(_number(node.right, kind, at), factor=factor)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        unit = UNITS.get(node.func.id)
        if unit is None or unit[0] != kind:
            raise _not_of_it(at)
        return Number(_literal(_only(node), at), node.func.id)
    return Number(_literal(node, at))


def _literal(node: ast.expr, at: ast.AST) -> float:
    if not isinstance(node, ast.Constant) or isinstance(node.value, bool) or not isinstance(node.value, int | float):
        raise _not_of_it(at)
    value = float(node.value)
    if not 0.0 <= value < 10_000.0:
        raise ProgramError(f"{value:g} is no number of the dialect ({_where(at)}).")
    return value


def _not_of_it(node: ast.AST) -> ProgramError:
    return ProgramError(f"`{ast.unparse(node).splitlines()[0][:80]}` is not of the dialect ({_where(node)}).")


def _where(node: ast.AST) -> str:
    return f"line {getattr(node, 'lineno', 1)}"
