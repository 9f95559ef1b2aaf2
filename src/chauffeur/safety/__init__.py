"""Safety before driving: small pure functions that judge a plan and never edit it."""

from chauffeur.safety.base import Check
from chauffeur.safety.checks import DEFAULT_CHECKS, DRIVE_CHECKS, run_checks
from chauffeur.safety.envelope import PARAMETERS_CHECK, check_parameters
from chauffeur.safety.format import FORMAT_CHECK, check_format
from chauffeur.safety.reach import REACH_CHECK, check_reach

__all__ = [
    "DEFAULT_CHECKS",
    "DRIVE_CHECKS",
    "FORMAT_CHECK",
    "PARAMETERS_CHECK",
    "REACH_CHECK",
    "Check",
    "check_format",
    "check_parameters",
    "check_reach",
    "run_checks",
]
