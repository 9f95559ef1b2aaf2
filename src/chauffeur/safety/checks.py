"""Running checks: all of them, in order, and none can take the caller down."""

from __future__ import annotations

import logging
from collections.abc import Sequence

from chauffeur.concept import Limits, Observation, Plan, Verdict
from chauffeur.concept.registry import load_plugin, plugin_names
from chauffeur.safety.base import Check
from chauffeur.safety.envelope import check_parameters
from chauffeur.safety.format import check_format
from chauffeur.safety.minimum_speed import check_minimum_speed
from chauffeur.safety.reach import check_reach

DEFAULT_CHECKS: tuple[Check, ...] = (check_format, check_parameters)
"""The two checks of the papers: format, then parameters in context."""

DRIVE_CHECKS: tuple[Check, ...] = (*DEFAULT_CHECKS, check_reach, check_minimum_speed)
"""Checks before a drive for a person: also what no reading of constants finds, at some milliseconds a program, and
the least speed among others. A benchmark's own rules know neither."""

GROUP = "chauffeur.checks"
"""Entry points of further checks."""

_log = logging.getLogger(__name__)


def drive_checks() -> tuple[Check, ...]:
    """`DRIVE_CHECKS`, then those of installed packages, by name. Raises ConfigError: one of them cannot be loaded."""
    return (*DRIVE_CHECKS, *(load_plugin(GROUP, name) for name in plugin_names(GROUP)))


def run_checks(
    plan: Plan, observation: Observation, limits: Limits, checks: Sequence[Check] = DEFAULT_CHECKS
) -> tuple[Verdict, ...]:
    """Every check's verdict, in order. A check that breaks has compared nothing and not vouched for the
    plan: its verdict is a refusal."""
    return tuple(_judge(check, plan, observation, limits) for check in checks)


def _judge(check: Check, plan: Plan, observation: Observation, limits: Limits) -> Verdict:
    try:
        return check(plan, observation, limits)
    except Exception as error:  # noqa: BLE001 - whatever a check dies of, the vehicle stays under control
        name = getattr(check, "__name__", type(check).__name__)
        _log.warning("safety check %s failed: %r", name, error)
        return Verdict(
            name, False, f"The check {name} could not judge this plan ({type(error).__name__}).", None,
            "Ask again; if it stays so, the plan's values are of the wrong types.", not_compared="check-broke",
        )  # fmt: skip
