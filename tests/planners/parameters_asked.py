"""Asks a planner of parameters, where the car is on built-in roads."""

from __future__ import annotations

import asyncio

from chauffeur.concept import (
    Context,
    History,
    Instruction,
    Limits,
    Plan,
    PlanRequest,
    Situation,
    SystemMessage,
)
from chauffeur.concept.nouns import Lead
from chauffeur.planners.base import Planner

SIGN = 30.0
BEHIND = Situation("highway", 24.0, SIGN, 3, 1, False, Lead(7, 40.0, 22.0), None)
LEFT = Situation("highway", 28.0, SIGN, 3, 0, False, None, None)
LOT = Situation("parking", 2.0, 4.0, 1, 0, False, None, None)


def plan(
    planner: Planner,
    wish: str,
    situation: Situation,
    limits: Limits | None = None,
    history: History | None = None,
    confirmed: str = "",
) -> Plan:
    """What it answers."""
    asked = PlanRequest(
        Instruction(wish, confirmed=confirmed),
        Context("", situation),
        SystemMessage(""),
        history or History(),
        limits=limits or Limits(),
    )
    return asyncio.run(planner.plan(asked))
