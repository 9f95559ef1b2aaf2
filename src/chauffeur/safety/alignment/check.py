"""`alignment-v1`: the thoughts that are shown to the person describe the program that will run."""

from __future__ import annotations

from chauffeur.concept import Limits, Plan, Program, Snapshot, Verdict
from chauffeur.safety.alignment.comparing import Mismatch
from chauffeur.safety.alignment.facts import Surroundings
from chauffeur.safety.alignment.judge import judge
from chauffeur.safety.alignment.tracing import read_facts

ALIGNMENT_CHECK = "alignment-v1"


def check_alignment(plan: Plan, snapshot: Snapshot, limits: Limits) -> Verdict:  # noqa: ARG001 - one shape for all checks
    """Whether what the plan's thoughts claim is what its program does, as far as reading both tells.

    A plan without thoughts, or with another policy than a program, claims nothing that could be wrong here.
    """
    if not isinstance(plan.policy, Program) or not plan.thoughts.text.strip():
        return Verdict(ALIGNMENT_CHECK, True, "There is no explanation of a program to compare.")
    facts = read_facts(plan.policy.source, plan.policy.library)
    if not facts.readable:
        return Verdict(ALIGNMENT_CHECK, True, "The program cannot be read, so its explanation was not compared.")
    found = judge(plan.thoughts.text, facts, Surroundings.of(snapshot))
    if found.aligned:
        return Verdict(ALIGNMENT_CHECK, True, f"The explanation fits the program ({found.claims} claims compared).")
    line = next((one.line for one in found.mismatches if one.line is not None), None)
    return Verdict(
        ALIGNMENT_CHECK,
        False,
        " ".join(_words(one) for one in found.mismatches),
        line,
        "Let the thoughts say what the program does, or the program do what the thoughts say.",
    )


def _words(mismatch: Mismatch) -> str:
    if not mismatch.sentence:
        return f"The program does something that the explanation does not mention: {mismatch.instead}."
    return f"The explanation says {mismatch.sentence!r}, but of the program: {mismatch.instead}."
