"""Kinds of policy that a planner writes, found by asking it a wish in one scenario for each kind of road."""

from __future__ import annotations

import asyncio
from typing import Final

from chauffeur.concept import NOBODY, ChauffeurError, Limits
from chauffeur.driving.planning import checked
from chauffeur.driving.scenarios import find
from chauffeur.driving.session import Session, make_world, parse_wish
from chauffeur.planners.base import Planner

PLACES: Final = ("cruise", "parking-exit", "open-road", "track-lane-change")
"""Scenarios whose listed wishes are asked: highway, lot, open road, and a manoeuvre on the test track."""
_ASK_WITHIN_S: Final = 120.0
"""For an answer of a large model on a slow server."""


async def kinds_written(planner: Planner) -> dict[str, str]:
    """Kind of the policy that it plans in each scenario: empty text for none that can be driven there, and no entry for
    a scenario in which it could not be asked. Nothing is driven.

    Raises:
        ChauffeurError: It answered nowhere; the last error.
    """
    found: dict[str, str] = {}
    last = ChauffeurError(f"{planner.id} gave no plan within {_ASK_WITHIN_S:.0f} s.")
    for place in PLACES:
        try:
            found[place] = await _kind_at(planner, place)
        except TimeoutError:
            continue
        except ChauffeurError as error:
            last = error
        except Exception as error:  # noqa: BLE001 - a planner may be anybody's code
            last = ChauffeurError(f"The planner {planner.id} failed: {type(error).__name__}: {error}")
    if not found:
        raise last
    return found


async def _kind_at(planner: Planner, place: str) -> str:
    scenario, limits = find(place), Limits()
    wish = parse_wish(scenario.wish, NOBODY)
    request = await Session(planner).request(wish, scenario, scenario.seed, limits)
    async with asyncio.timeout(_ASK_WITHIN_S):
        plan = await planner.plan(request)
    if plan.policy is None or checked(plan, make_world(scenario).reset(scenario, scenario.seed), limits).refusal:
        return ""
    return plan.policy.kind
