"""`format-v1` for every kind of policy, and the runner that holds the checks."""

from __future__ import annotations

import logging
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType

import pytest
from check_scenes import judged_by, parameters, plan, program, snap
from golden_sentences import compare, outcome, row

from chauffeur.concept import (
    ActionMatrix,
    Limits,
    Observation,
    Plan,
    Program,
    Trajectory,
    Verdict,
)
from chauffeur.safety.checks import DEFAULT_CHECKS, DRIVE_CHECKS, run_checks
from chauffeur.safety.envelope import check_parameters
from chauffeur.safety.format import check_format
from chauffeur.safety.minimum_speed import check_minimum_speed
from chauffeur.safety.reach import check_reach

LIMITS = Limits()
judge = judged_by(check_format, "format-v1")
BIG = 10**400
ONES = (1.0, 1.0, 1.0)


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


def test_a_plan_that_says_why_it_drives_nothing_is_not_compared() -> None:
    said = judge(plan(None, refusal="I do not fly."), snap())
    assert (said.state, said.not_compared, said.stops) == ("not_compared", "no-policy", False)


def test_the_gate_s_first_finding_is_the_reason(gate: Callable[..., None]) -> None:
    first, more = Finding(3, "It imports os.", "Leave it out."), Finding(9, "b", "c")
    gate()
    assert judge(plan(Program("anything")), snap()).passed
    gate(first)
    assert judge(plan(Program("x")), snap()) == Verdict("format-v1", False, "It imports os.", 3, "Leave it out.")
    for others, said in ((2, "(and 2 more findings)"), (1, "(and 1 more finding)")):
        gate(first, *[more] * others)
        assert judge(plan(Program("x")), snap()).reason == f"It imports os. {said}"


def test_the_language_s_own_gate_is_asked() -> None:
    assert judge(plan(program("set_target_speed(25)")), snap()).passed
    verdict = judge(plan(program("fly()")), snap())
    assert (verdict.passed, verdict.line) == (False, 3)
    assert "fly" in verdict.reason


def test_the_helper_functions_of_a_program_are_judged_with_it() -> None:
    main = "def main():\n    yield from helper()\n"
    good = Program(main, library="def helper():\n    set_target_speed(25)\n    yield autopilot()\n")
    assert judge(plan(good), snap()).passed
    assert all(verdict.passed for verdict in run_checks(plan(good), snap(), LIMITS))
    assert "helper" in judge(plan(Program(main)), snap()).reason
    bad = judge(plan(Program(main, library="def helper():\n    import os\n    yield\n")), snap())
    assert (bad.passed, bad.line) == (False, None)
    assert "of the library" in bad.reason


def test_a_program_too_long_to_be_read_is_refused_here() -> None:
    assert not judge(plan(Program(program("set_target_speed(99)").source.ljust(100_001, "#"))), snap()).passed


FAULTS = (
    None,
    parameters(lane=2), parameters(speed="x"), parameters(ahead=math.inf), parameters(ratio=None),
    parameters(route="x" * 10_000),
    ActionMatrix((1.0, 2.0), ONES),
    *(ActionMatrix(tuple("?" if i == place else 1.0 for i in range(3)), ONES) for place in range(3)),
    *(ActionMatrix(ONES, tuple("?" if i == place else 1.0 for i in range(3))) for place in range(3)),
    Trajectory((), 0.5), Trajectory(((1.0, 0.0),), 0.0), Trajectory(((1.0, 0.0), (2.0,)), 0.5),
    Trajectory(((1.0, 0.0), (2.0, math.nan)), 0.5),
    {"a": 1},
)  # fmt: skip
FITTING = (program("pass"), parameters(), ActionMatrix(ONES, ONES), Trajectory(((1.0, 0.0),), 0.5))


def test_what_is_said_of_a_form() -> None:
    found = {repr(policy)[:200]: judge(plan(policy), snap()) for policy in FAULTS}
    fitting = {repr(policy): judge(plan(policy), snap()) for policy in FITTING}
    assert {outcome(one) for one in found.values()} == {"refused"}
    assert {outcome(one) for one in fitting.values()} == {"fits"}
    compare("format-v1", {name: row(one) for name, one in (found | fitting).items()})


@pytest.mark.parametrize(
    ("policy", "passes"),
    [
        (parameters(lane=-1), True), (parameters(lane=1, speed=15), True), (parameters(route="stadium"), True),
        (parameters(speed=math.nan), False), (parameters(ratio=-math.inf), False), (parameters(speed=True), False),
        (parameters(speed=BIG), False), (parameters(speed=sys.float_info.max), True),
        (ActionMatrix(ONES, (1.0, 1.0, math.nan)), False), (ActionMatrix(ONES, (1.0,)), False),
        (Trajectory(((1.0, 0.0), (2.0, 0.0)), 0.5), True), (Trajectory(((1.0, 0.0),), -0.5), False),
        (Trajectory(((1.0, 0.0),), math.nan), False), (Trajectory(((1.0, math.inf),), 0.5), False),
        ("set_target_speed(30)", False),
    ],
)  # fmt: skip
def test_every_kind_of_policy(policy: object, passes: bool) -> None:
    assert judge(plan(policy), snap()).passed is passes


# The runner -----------------------------------------------------------------------------------------------------------


def test_the_checks_are_those_of_the_papers_and_before_a_drive_of_people_two_more() -> None:
    assert (check_format, check_parameters) == DEFAULT_CHECKS
    assert (*DEFAULT_CHECKS, check_reach, check_minimum_speed) == DRIVE_CHECKS


@pytest.mark.parametrize(("speed", "passes"), [(15.0, True), (math.nan, False)])
def test_all_checks_run_in_order(speed: float, passes: bool) -> None:
    verdicts = run_checks(plan(parameters(speed=speed)), snap(), LIMITS)
    assert [(v.check, v.passed) for v in verdicts] == [("format-v1", passes), ("parameters-v1", passes)]


def test_a_check_that_breaks_refuses_and_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    def check_luck(plan: Plan, observation: Observation, limits: Limits) -> Verdict:
        raise ZeroDivisionError("no luck")

    class Fortune:
        def __call__(self, plan: Plan, observation: Observation, limits: Limits) -> Verdict:
            raise KeyError("wheel")

    with caplog.at_level(logging.WARNING):
        found = run_checks(plan(program("pass")), snap(), LIMITS, (check_luck, check_format, Fortune()))
    assert [(one.check, outcome(one), one.stops) for one in found] == [
        ("check_luck", "check-broke", True), ("format-v1", "fits", False), ("Fortune", "check-broke", True),
    ]  # fmt: skip
    compare("a check that broke", {one.check: row(one) for one in found if one.stops})
    assert [record.getMessage() for record in caplog.records] == [
        "safety check check_luck failed: ZeroDivisionError('no luck')",
        "safety check Fortune failed: KeyError('wheel')",
    ]


@pytest.mark.parametrize(
    "policy", [Trajectory(None, 0.5), ActionMatrix(None, None), Program(None), Trajectory((1, 2), 0.5)]
)
def test_nonsense_in_place_of_a_policy_ends_in_a_refusal(policy: object) -> None:
    verdicts = run_checks(plan(policy), snap(), LIMITS)
    assert not all(verdict.passed for verdict in verdicts)
