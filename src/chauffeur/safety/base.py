"""The protocol of checks: small pure functions that judge a plan and never edit it."""

from __future__ import annotations

from typing import Protocol

from chauffeur.concept import Limits, Observation, Plan, Verdict


class Check(Protocol):
    """Judges a plan in a situation."""

    def __call__(self, plan: Plan, observation: Observation, limits: Limits) -> Verdict:
        """The verdict; never raises on bad plans, never changes them."""
        ...
