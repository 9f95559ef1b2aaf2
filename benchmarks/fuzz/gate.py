"""The static gate and its parser."""

from __future__ import annotations

from chauffeur.programs.gate import check_source
from chauffeur.programs.rewrite import prepare
from chauffeur.safety.constant_calls import read_program
from fuzz.programs import changed, seeds, split
from fuzz.target import Target, expect


def examine(data: bytes) -> str:
    """Judge a program, and make one that passes ready for the sandbox."""
    source, library = split(data)
    report = check_source(source, library)
    lines = source.count("\n") + source.count("\r") + 1
    for finding in report.findings:
        expect(finding.line is None or 1 <= finding.line <= lines, "a finding's line is outside the text")
        expect(finding.reason, "a finding gives no reason")
    read_program(source)
    if not report.passed:
        return "refused"
    expect(report.main, "a program that passes has no main function")
    prepare(source, library)
    return "passed"


TARGET = Target(
    name="gate",
    invariant=(
        "No text makes the gate raise; a finding's line is one of the text's; what passes has a main function and can "
        "be made ready for the sandbox."
    ),
    reads=("chauffeur.programs", "chauffeur.safety.constant_calls"),
    seeds=seeds,
    changed=changed,
    examine=examine,
)
