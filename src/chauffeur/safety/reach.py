"""`reach-v1`: nothing a program can be followed to goes beyond the limits, and none of its loops is endless.

`parameters-v1` reads the constants of a program; this check follows it, as far as that is possible without driving:
through arithmetic, branches, loops and helper functions. It refuses

- an argument all of whose possible values are beyond the limits,
- an argument whose range has a bound beyond the limits that constants of the program alone come to on some way,
- an argument that is never of the kind the driving API takes, where the program does not catch the error,
- a loop that never yields and that nothing but an error ends.

What depends on what the road answers, e.g. the speed of the vehicle ahead plus 5 m/s, is no ground to refuse: whether
it stays within the limits shows while driving. The verdict says in its reason what was not proven.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal

from chauffeur.concept import Limits, Observation, Plan, Program, Verdict
from chauffeur.programs.catalogue import Param, apis_of
from chauffeur.programs.errors import ProgramSyntaxError
from chauffeur.programs.loops import MAX_BARE_RANGE
from chauffeur.programs.verify import CallSite, Circumstances, LoopReport, Value, Verification, VerificationNote, verify
from chauffeur.safety.words import IN_A_HELPER, speed_words

REACH_CHECK: Final = "reach-v1"

_ROUNDING: Final = 1e-6
"""Slack at every bound, as in `parameters-v1`."""
_MAX_SHOWN: Final = 3
"""More doubts do not help anybody."""
_ORDERED: Final = {"set_target_speed": "target speed", "set_desired_time_headway": "time headway"}


@dataclass(frozen=True, slots=True)
class _Bounds:
    """Bounds of a number of a driving API.

    Attributes:
        what: What it is, in words.
        low, high: Bounds for what the program's own constants come to.
        most: Upper bound for what depends on the road: the limit of a lane that the ego may come to.
        unit: `m/s`, `s`, ...
        why: Which limit `high` is, in words.
    """

    what: str
    low: float
    high: float
    most: float
    unit: str
    why: str

    def words(self, number: float) -> str:
        """A number with its unit."""
        return speed_words(number) if self.unit == "m/s" else f"{number:.4g} {self.unit}"

    @property
    def remedy(self) -> str:
        """Remedy for a number out of bounds."""
        return f"Use a {self.what} from {self.low:g} to {self.words(self.high)}."


@dataclass(frozen=True, slots=True)
class _Finding:
    """`severity` is `doubt` for what is not proven, `fault` for what refuses the plan."""

    severity: Literal["fault", "doubt"]
    reason: str
    line: int | None
    remedy: str = ""


def check_reach(plan: Plan, observation: Observation, limits: Limits) -> Verdict:
    """Judge whether everything that a program can be followed to stays within the limits."""
    if not isinstance(plan.policy, Program):
        return Verdict(REACH_CHECK, True, "There is no program to follow.", not_compared="no-program")
    where = Circumstances.of(observation)
    try:
        report = verify(plan.policy.source, plan.policy.library, where)
    except ProgramSyntaxError as error:
        return Verdict(
            REACH_CHECK, False, f"The program cannot be followed: {error.message}", error.line, "Write a program."
        )
    return judged(report, where, limits)


def judged(report: Verification, where: Circumstances, limits: Limits) -> Verdict:
    """The verdict on a verified program."""
    found = [*_call_findings(report, where, limits), *_loop_findings(report), *_note_findings(report)]
    found.sort(key=lambda finding: math.inf if finding.line is None else finding.line)
    faults = [finding for finding in found if finding.severity == "fault"]
    if faults:
        reasons = list(dict.fromkeys(fault.reason for fault in faults))
        return Verdict(REACH_CHECK, False, " ".join(reasons), faults[0].line, faults[0].remedy)
    doubts = list(dict.fromkeys(_placed(finding) for finding in found))
    if not report.complete:
        doubts.insert(0, f"the program was not followed to its end ({report.problem}).")
    if not doubts:
        return Verdict(REACH_CHECK, True, "Everything the program can come to fits the situation.")
    more = f" And {len(doubts) - _MAX_SHOWN} more." if len(doubts) > _MAX_SHOWN else ""
    reason = f"Nothing is known to be beyond the limits. Not proven or odd: {' '.join(doubts[:_MAX_SHOWN])}{more}"
    return Verdict(REACH_CHECK, True, reason, proven=False)


def _placed(finding: _Finding) -> str:
    return finding.reason if finding.line is None else f"line {finding.line}: {finding.reason}"


# Arguments ---------------------------------------------------------------------------------------------------------


def _call_findings(report: Verification, where: Circumstances, limits: Limits) -> Iterator[_Finding]:
    for site in report.calls:
        for argument in site.arguments:
            param = next((param for param in apis_of("town")[site.name].params if param.name == argument.name), None)
            if param is None:
                continue
            if param.kind == "number":
                yield from _number_findings(site, param, argument.value, _bounds(site.name, param, where, limits))
            elif param.kind in {"vehicle", "lane"}:
                yield from _handle_findings(site, param, argument.value)


def _bounds(name: str, param: Param, where: Circumstances, limits: Limits) -> _Bounds:
    if name in {"set_target_speed", "proceed"}:
        here = where.speed_limits_mps[0] if where.speed_limit_mps is None else where.speed_limit_mps
        cap = math.inf if limits.max_speed_mps is None else limits.max_speed_mps
        high = here + limits.max_over_limit_mps
        why = f"more than {speed_words(limits.max_over_limit_mps)} above the speed limit of {speed_words(here)} here"
        if cap < high:
            high, why = cap, f"above the cap of {speed_words(cap)}"
        most = max(high, min(cap, where.speed_limits_mps[1] + limits.max_over_limit_mps))
        return _Bounds("target speed", 0.0, high, most, "m/s", why)
    if name == "set_desired_time_headway":
        low, high = limits.min_time_headway_s, limits.max_time_headway_s
        return _Bounds("time headway", low, high, high, "s", f"outside {low:g} to {high:g} s")
    assert param.low is not None  # every number of the catalogue has both bounds
    assert param.high is not None
    what = f"{param.name} of {name}"
    return _Bounds(what, param.low, param.high, param.high, param.unit, f"outside {param.low:g} to {param.high:g}")


def _number_findings(site: CallSite, param: Param, value: Value, bounds: _Bounds) -> Iterator[_Finding]:
    if not value.may_be_number:
        if not (site.guarded or (value.may_be_none and param.optional)):
            yield _fault(site, f"The {bounds.what} is never a number there.", bounds.remedy)
        return
    low, high = bounds.low - _ROUNDING, bounds.high + _ROUNDING
    if value.lo > value.hi:  # NaN is the only number it can be
        yield _fault(site, f"The {bounds.what} is nan, not a number.", bounds.remedy)
    elif value.lo > bounds.most + _ROUNDING or value.hi < low:
        nearest = value.lo if value.lo > bounds.most else value.hi
        way = "" if value.lo == value.hi else " or more" if nearest > high else " or less"
        yield _fault(site, _beyond(bounds, nearest, way), bounds.remedy)
    elif value.own and not low <= value.lo <= value.hi <= high:
        worst = value.hi if value.hi > high else value.lo
        way = "" if value.lo == value.hi else ", come to on one way through the program,"
        yield _fault(site, _beyond(bounds, worst, way), bounds.remedy)
    elif site.name in _ORDERED and not (low <= value.lo and value.hi <= high and not value.may_be_nan):
        span = f"{bounds.low:g} to {bounds.words(bounds.high)}"
        yield _doubt(site, f"the {bounds.what} cannot be foreseen; that it stays from {span} is not proven.")


def _beyond(bounds: _Bounds, number: float, way: str) -> str:
    problem = "negative" if bounds.unit == "m/s" and number < 0 else bounds.why
    return f"A {bounds.what} of {bounds.words(number)}{way} is {problem}."


def _handle_findings(site: CallSite, param: Param, value: Value) -> Iterator[_Finding]:
    if param.optional or site.guarded or not value.may_be_none:
        return
    if value.is_none:
        yield _fault(
            site, f"{site.name} is given None for its {param.kind} there, and fails.", "Test first that it is not None."
        )
    elif value.known:
        yield _doubt(site, f"{site.name} fails if its {param.kind} is None.")


# Loops and notes ---------------------------------------------------------------------------------------------------


def _loop_findings(report: Verification) -> Iterator[_Finding]:
    for loop in report.loops if report.complete else ():
        line = None if loop.in_library else loop.line
        if loop.verdict == "endless":
            reason = "A loop never yields, and nothing but an error ends it."
            yield _Finding(
                "fault", f"{reason}{_helper(loop)}", line, "Put `yield autopilot()` into the loop, or leave it."
            )
        elif loop.verdict == "unknown":
            yield _Finding("doubt", f"of this loop {loop.reason}.{_helper(loop)}", line)
        elif loop.verdict == "bounded" and loop.passes is not None and loop.passes > MAX_BARE_RANGE:
            yield _Finding("doubt", f"this loop may make {loop.passes} passes without a yield.{_helper(loop)}", line)


def _note_findings(report: Verification) -> Iterator[_Finding]:
    for note in report.notes:
        if note.code != "unreachable" or note.wish:
            reason = note.reason[0].lower() + note.reason[1:]
            yield _Finding("doubt", f"{reason}{_helper(note)}", None if note.in_library else note.line)


def _fault(site: CallSite, reason: str, remedy: str) -> _Finding:
    return _Finding("fault", f"{reason}{_helper(site)}", None if site.in_library else site.line, remedy)


def _doubt(site: CallSite, reason: str) -> _Finding:
    return _Finding("doubt", f"{reason}{_helper(site)}", None if site.in_library else site.line)


def _helper(place: CallSite | LoopReport | VerificationNote) -> str:
    """Lines are counted in the program; a helper is known by its reason alone."""
    return f" {IN_A_HELPER}" if place.in_library else ""
