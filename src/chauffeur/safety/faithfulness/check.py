"""`alignment-v1`: the thoughts that are shown to the person describe the program; `alignment-driven-v1`: and the drive.

Both inform: an explanation that does not fit is told, and the drive goes on.
"""

from __future__ import annotations

import re
from typing import Final

from chauffeur.concept import Faithfulness, Limits, NotCompared, Observation, Plan, Program, Verdict
from chauffeur.safety.faithfulness.facts import Effect, Facts, FactSurroundings
from chauffeur.safety.faithfulness.judge import judge, judge_drive
from chauffeur.safety.faithfulness.relations import read_facts
from chauffeur.safety.faithfulness.report import claims_words, mismatch_words, score_words

FAITHFULNESS_CHECK: Final = "alignment-v1"
DRIVEN_CHECK: Final = "alignment-driven-v1"

_NAMES_ROAD_USERS: Final = re.compile(r"\bagent\(")
_REMEDY: Final = "Let the thoughts say what the program does, or the program do what the thoughts say."


def check_faithfulness(plan: Plan, observation: Observation, limits: Limits) -> Verdict:  # noqa: ARG001 - one shape for all checks
    """Judge whether what the plan's thoughts claim is what its program does, as far as reading both tells.

    A plan without thoughts, or with another policy than a program, claims nothing that could be wrong here.
    """
    facts = _facts(plan)
    if not isinstance(facts, Facts):
        return _not_compared(FAITHFULNESS_CHECK, facts)
    found = judge(plan.thoughts.text, facts, FactSurroundings.of(observation))
    return _verdict(
        FAITHFULNESS_CHECK, found, "The explanation fits the program", "The explanation does not fit the program"
    )


def check_driven(plan: Plan, observation: Observation, effect: Effect) -> Verdict:
    """Judge whether what the plan's thoughts claim is what then happened.

    Args:
        plan: What was driven.
        observation: The instant it began.
        effect: What happened.
    """
    facts = "policy-failed" if effect.failed else _facts(plan)
    if not isinstance(facts, Facts):
        return _not_compared(DRIVEN_CHECK, facts)
    found = judge_drive(plan.thoughts.text, facts, FactSurroundings.of(observation), effect)
    return _verdict(DRIVEN_CHECK, found, "The drive went as explained", "The drive did not go as explained")


_NOT_COMPARED: Final[dict[NotCompared, str]] = {
    "no-program": "There is no program to compare an explanation with.",
    "no-explanation": "There is no explanation to compare.",
    "no-claims": "The explanation claims nothing that can be compared.",
    "unreadable": "The program cannot be read.",
    "policy-failed": "The program failed on the way.",
    "road-users": "The program is about single road users, which reading compares with no explanation.",
}


def _not_compared(check: str, why: NotCompared) -> Verdict:
    return Verdict(check, True, _NOT_COMPARED[why], vetoes=False, not_compared=why)


def _facts(plan: Plan) -> Facts | NotCompared:
    """Facts of the plan's program, or why there is nothing to compare."""
    if not isinstance(plan.policy, Program):
        return "no-program"
    if not plan.thoughts.text.strip():
        return "no-explanation"
    if _NAMES_ROAD_USERS.search(plan.policy.source):
        return "road-users"
    facts = read_facts(plan.policy.source, plan.policy.library)
    return facts if facts.readable else "unreadable"


def _verdict(check: str, found: Faithfulness, fits: str, differs: str) -> Verdict:
    if found.aligned and not found.claims:
        return _not_compared(check, "no-claims")
    if found.aligned:
        return Verdict(check, True, f"{fits} ({claims_words(found)}).", vetoes=False, alignment=found)
    line = next((one.line for one in found.mismatches if one.line is not None), None)
    told = ". ".join(_capital(mismatch_words(one)) for one in found.mismatches)
    reason = f"{differs} ({score_words(found)}). {told}."
    return Verdict(check, False, reason, line, _REMEDY, vetoes=False, alignment=found)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
