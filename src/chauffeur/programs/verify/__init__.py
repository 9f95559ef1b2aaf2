"""What a program can do, found out without running it: every argument as a set, every loop's end, dead wishes."""

from chauffeur.programs.verify.circumstances import ANYWHERE, Circumstances
from chauffeur.programs.verify.report import Argument, CallSite, LoopReport, LoopVerdict, Verification, VerificationNote
from chauffeur.programs.verify.values import Value
from chauffeur.programs.verify.verifier import verify

__all__ = [
    "ANYWHERE",
    "Argument",
    "CallSite",
    "Circumstances",
    "LoopReport",
    "LoopVerdict",
    "Value",
    "Verification",
    "VerificationNote",
    "verify",
]
