"""What a check is: a small pure function that judges a plan and never edits it."""

from __future__ import annotations

from typing import Protocol

from chauffeur.concept import Limits, Plan, Snapshot, Verdict


class Check(Protocol):
    """Judges a plan in a situation."""

    def __call__(self, plan: Plan, snapshot: Snapshot, limits: Limits) -> Verdict:
        """The verdict; never raises on bad plans, never changes them."""
        ...
