"""The verifier and the checks before a drive: what they promise of a program holds when it runs."""

from __future__ import annotations

import zlib
from functools import cache

from chauffeur.concept import Limits, Plan, Program, Thoughts
from chauffeur.programs import APIS, Budget, ProgramExecutor, ProgramSyntaxError, Sandbox, check_source
from chauffeur.programs.binding import MadeCall
from chauffeur.programs.verify import Circumstances, Verification, verify
from chauffeur.safety.envelope import check_parameters
from chauffeur.safety.faithfulness import check_faithfulness
from chauffeur.safety.format import check_format
from chauffeur.safety.reach import check_reach
from fuzz.programs import changed, seeds, split
from fuzz.road import drive_on, world_for
from fuzz.target import Target, expect

TICKS = 4
LIMITS = Limits()
_THOUGHTS = Thoughts(
    "First I look whether the left lane is free, then I overtake at 25 m/s and go back after 3 seconds."
)
_CHECKS = (check_format, check_parameters, check_reach, check_faithfulness)
_PATIENT = Budget(turn_s=0.2, tick_s=2.0, grace_s=0.5, start_s=2.0)
_PLAIN = int | float | str | None
_SLACK = 1e-6


@cache
def _sandbox() -> Sandbox:
    return Sandbox(_PATIENT, workers=1)


def examine(data: bytes) -> str:
    """Verify a program, and hold what is said of it against what it does."""
    source, library = split(data)
    passed = check_source(source, library).passed
    world = world_for(zlib.crc32(data))
    observation = world.observe()
    plan = Plan(_THOUGHTS, Program(source, library=library))
    verdicts = [check(plan, observation, LIMITS) for check in _CHECKS]
    expect(verdicts[0].passed == passed, "format-v1 and the gate differ")
    where = Circumstances.of(observation)
    try:
        report = verify(source, library, where)
    except ProgramSyntaxError:
        expect(not passed, "the gate accepts what the verifier cannot read")
        return "not a program"
    if not passed:
        return "refused"
    fits = verdicts[2].passed and verdicts[2].reason.startswith("Everything")
    highest = where.speed_limits_mps[1] + LIMITS.max_over_limit_mps
    with ProgramExecutor(sandbox=_sandbox(), library=library) as executor:
        executor.start(source, world)
        for _ in range(TICKS):
            result = executor.tick()
            expect(
                result.state != "running" or result.line not in report.unreachable, "a line was reached that never is"
            )
            for call in result.made:
                _is_foreseen(report, call)
                if fits and call.refused is None:
                    _is_within(call, highest)
            if result.state != "running":
                break
            drive_on(world, result)
    return "fits" if fits else "followed" if report.complete else "given up"


def _is_foreseen(report: Verification, call: MadeCall) -> None:
    sites = [site for site in report.calls if site.name == call.name]
    expect(sites, f"a call of {call.name} was not foreseen")
    for param, value in zip(APIS[call.name].params, call.given, strict=False):
        if isinstance(value, _PLAIN):
            held = [found for site in sites if (found := site.argument(param.name)) is not None]
            expect(any(one.holds(value) for one in held), f"an argument of {call.name} was not foreseen")


def _is_within(call: MadeCall, highest_mps: float) -> None:
    value = call.given[0] if call.given else None
    if call.name == "set_target_speed":
        within = isinstance(value, int | float) and -_SLACK <= value <= highest_mps + _SLACK
        expect(within, "a target speed is beyond the limits that reach-v1 found it within")
    elif call.name == "set_desired_time_headway":
        low, high = LIMITS.min_time_headway_s - _SLACK, LIMITS.max_time_headway_s + _SLACK
        expect(
            isinstance(value, int | float) and low <= value <= high,
            "a time headway is beyond the limits that reach-v1 found it within",
        )


TARGET = Target(
    name="verifier",
    invariant=(
        "No text makes the verifier or a check raise anything but ProgramSyntaxError; of what the gate accepts, every "
        "call made within 4 control periods was foreseen with its arguments, no unreachable line is reached, and what "
        "reach-v1 finds within the limits without a doubt stays within them."
    ),
    reads=("chauffeur.programs.verify", "chauffeur.safety"),
    seeds=seeds,
    changed=changed,
    examine=examine,
)
