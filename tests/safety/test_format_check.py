"""`format-v1` for every kind of policy, and the runner that holds the checks."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType

import pytest

from chauffeur.concept import (
    ActionMatrix,
    Limits,
    Observation,
    Parameters,
    Plan,
    Program,
    Trajectory,
    Verdict,
)
from chauffeur.safety.checks import DEFAULT_CHECKS, run_checks
from chauffeur.safety.envelope import check_parameters
from chauffeur.safety.format import FORMAT_CHECK, check_format

Snap = Callable[..., Observation]
Make = Callable[..., Plan]
LIMITS = Limits()
BIG = 10**400


@dataclass
class Finding:
    line: int | None
    reason: str
    remedy: str


@dataclass
class Report:
    errors: tuple[Finding, ...]


@pytest.fixture
def gate(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Put a gate with given findings in place of the language's own."""

    def use(*findings: Finding) -> None:
        module = ModuleType("chauffeur.programs.gate")
        module.check_source = lambda *_: Report(findings)  # type: ignore[attr-defined]
        monkeypatch.setitem(sys.modules, "chauffeur.programs.gate", module)

    return use


def judge(plan: Plan, observation: Observation) -> Verdict:
    verdict = check_format(plan, observation, LIMITS)
    assert verdict.check == FORMAT_CHECK == "format-v1"
    assert verdict.reason
    assert bool(verdict.remedy) is not verdict.passed
    return verdict


def test_a_plan_that_says_why_it_drives_nothing_is_not_compared(snap: Snap, plan: Make) -> None:
    said = judge(plan(None, refusal="I do not fly."), snap())
    assert (said.state, said.not_compared, said.stops) == ("not_compared", "no-policy", False)
    silent = judge(plan(None), snap())
    assert (silent.passed, silent.reason) == (False, "The planner gave no policy.")


def test_a_program_the_gate_accepts_passes(snap: Snap, plan: Make, gate: Callable[..., None]) -> None:
    gate()
    assert judge(plan(Program("anything")), snap()).passed


def test_the_gate_s_first_finding_is_the_reason(snap: Snap, plan: Make, gate: Callable[..., None]) -> None:
    gate(Finding(3, "It imports os.", "Leave it out."))
    assert judge(plan(Program("x")), snap()) == Verdict("format-v1", False, "It imports os.", 3, "Leave it out.")
    gate(Finding(3, "It imports os.", "Leave it out."), Finding(9, "b", "c"), Finding(9, "b", "c"))
    assert judge(plan(Program("x")), snap()).reason == "It imports os. (and 2 more findings)"
    gate(Finding(3, "It imports os.", "Leave it out."), Finding(9, "b", "c"))
    assert judge(plan(Program("x")), snap()).reason == "It imports os. (and 1 more finding)"


def test_the_language_s_own_gate_is_asked(snap: Snap, plan: Make) -> None:
    good = Program("def policy():\n    set_target_speed(25)\n    while True:\n        yield autopilot()\n")
    assert judge(plan(good), snap()).passed
    verdict = judge(plan(Program("def policy():\n    fly()\n    while True:\n        yield autopilot()\n")), snap())
    assert (verdict.passed, verdict.line) == (False, 2)
    assert "fly" in verdict.reason


def test_the_helper_functions_of_a_program_are_judged_with_it(snap: Snap, plan: Make) -> None:
    main = "def main():\n    yield from helper()\n"
    good = Program(main, library="def helper():\n    set_target_speed(25)\n    yield autopilot()\n")
    assert judge(plan(good), snap()).passed
    assert all(verdict.passed for verdict in run_checks(plan(good), snap(), LIMITS))
    assert "helper" in judge(plan(Program(main)), snap()).reason
    bad = judge(plan(Program(main, library="def helper():\n    import os\n    yield\n")), snap())
    assert (bad.passed, bad.line) == (False, None) and "of the library" in bad.reason
    fast = Program(main, library=good.library.replace("25", "60"))
    verdict = check_parameters(plan(fast), snap(), LIMITS)
    assert (verdict.passed, verdict.line) == (False, None) and "(In a helper function.)" in verdict.reason


def test_a_program_too_long_to_be_read_is_refused_here(snap: Snap, plan: Make) -> None:
    from chauffeur.safety.constant_calls import _MAX_CHARS

    body = "def policy():\n    set_target_speed(99)\n    while True:\n        yield autopilot()\n"
    long = Program(body + "#" * (_MAX_CHARS - len(body) + 1))
    assert check_parameters(plan(long), snap(), LIMITS).passed
    assert not judge(plan(long), snap()).passed


def test_the_envelope_watches_apis_that_exist() -> None:
    from chauffeur.programs.catalogue import APIS
    from chauffeur.safety.constant_calls import _LANE_STEPS
    from chauffeur.safety.envelope import _TURNS

    watched = {
        *_TURNS,
        *_LANE_STEPS,
        "set_target_speed",
        "set_desired_time_headway",
        "set_target_lane",
        "is_safe_enter",
    }
    assert watched <= set(APIS)
    assert APIS["set_target_speed"].params[0].unit == "m/s"
    assert APIS["set_desired_time_headway"].params[0].unit == "s"


@pytest.mark.parametrize(
    ("policy", "passes"),
    [
        (Parameters(15.0, 10.0, 2.0, -1), True), (Parameters(15, 10, 2, 1), True),
        (Parameters(3.0, 4.0, 1.0, 0, "stadium"), True), (Parameters(3.0, 4.0, 1.0, 0, "x" * 10_000), False),
        (Parameters(math.nan, 10.0, 2.0), False),
        (Parameters(15.0, math.inf, 2.0), False), (Parameters(15.0, 10.0, -math.inf), False),
        (Parameters("15", 10.0, 2.0), False), (Parameters(True, 10.0, 2.0), False), (Parameters(BIG, 1.0, 2.0),
        False),
        (Parameters(sys.float_info.max, 1.0, 2.0), True), (Parameters(15.0, 10.0, 2.0, 2), False),

        (ActionMatrix((1.0, 0.1, 0.0), (1.0, 1.0, 1.0)), True), (ActionMatrix((1.0, 0.1, 0.0),
        (1.0, 1.0, math.nan)), False),
        (ActionMatrix((1.0, 0.1), (1.0, 1.0, 1.0)), False), (ActionMatrix((1.0, 0.1, 0.0), (1.0,)), False),

        (Trajectory(((1.0, 0.0), (2.0, 0.0)), 0.5), True), (Trajectory((), 0.5), False), (Trajectory(((1.0, 0.0),),
        0.0), False),
        (Trajectory(((1.0, 0.0),), -0.5), False), (Trajectory(((1.0, 0.0),), math.nan), False),
        (Trajectory(((1.0, math.inf),), 0.5), False), (Trajectory(((1.0, 0.0), (1.0,)), 0.5), False),

        ("set_target_speed(30)", False), ({"speed": 3}, False),
    ],
)  # fmt: skip
def test_every_kind_of_policy(snap: Snap, plan: Make, policy: object, passes: bool) -> None:
    assert judge(plan(policy), snap()).passed is passes


def test_reasons_name_the_thing_and_the_value(snap: Snap, plan: Make) -> None:
    def reason(policy: object) -> str:
        return judge(plan(policy), snap()).reason

    assert reason(Parameters(math.nan, 1.0, 1.0)) == ("target_speed_mps of the parameters is nan, not a finite number.")
    assert reason(Trajectory(((0.0, 0.0), (1.0, math.inf)), 0.1)).startswith("waypoint 2 y of the trajectory is inf")
    assert reason(ActionMatrix((1.0, 1.0, 1.0), (1.0, math.nan, 1.0))).startswith("Wh of the action matrix is nan")
    assert reason(Trajectory(((0.0, 0.0), (1.0,)), 0.1)) == "Waypoint 2 has 1 coordinates."
    assert reason("go") == "The policy is a str, which no executor knows."
    assert reason(Parameters(1.0, 1.0, 1.0, 7)) == "The lane wish is 7."


def test_all_checks_run_in_order(snap: Snap, plan: Make) -> None:
    assert (check_format, check_parameters) == DEFAULT_CHECKS
    verdicts = run_checks(plan(Parameters(15.0, 10.0, 2.0)), snap(), LIMITS)
    assert [(v.check, v.passed) for v in verdicts] == [("format-v1", True), ("parameters-v1", True)]
    verdicts = run_checks(plan(Parameters(math.nan, 10.0, 2.0)), snap(), LIMITS)
    assert [(v.check, v.passed) for v in verdicts] == [("format-v1", False), ("parameters-v1", False)]


def test_a_check_that_breaks_refuses(snap: Snap, plan: Make) -> None:
    def broken(plan: Plan, observation: Observation, limits: Limits) -> Verdict:
        raise ZeroDivisionError

    class Callable_:
        def __call__(self, plan: Plan, observation: Observation, limits: Limits) -> Verdict:
            raise KeyError("x")

    first, second, third = run_checks(
        plan(Parameters(15.0, 10.0, 2.0)), snap(), LIMITS, (broken, Callable_(), check_format)
    )
    assert (first.check, first.passed) == ("broken", False)
    assert first.reason == "The check broken could not judge this plan (ZeroDivisionError)."
    assert (second.check, second.passed) == ("Callable_", False)
    assert third.passed


@pytest.mark.parametrize(
    "policy", [Trajectory(None, 0.5), ActionMatrix(None, None), Program(None), Trajectory((1, 2), 0.5)]
)
def test_nonsense_in_place_of_a_policy_ends_in_a_refusal(snap: Snap, plan: Make, policy: object) -> None:
    verdicts = run_checks(plan(policy), snap(), LIMITS)
    assert not all(verdict.passed for verdict in verdicts)
