"""Budget of a run: counted before a call is sent, with what is in flight taken as dear as anything so far.

Neither the price of a reply nor whether a plan needs a second request is known before it is there, so a budget can be
overrun only by what is in flight:

- requests: each plan in flight counts as the most requests a plan may take, the one to be sent as one. A budget is
  overrun by at most the repair turns of the last plan.
- money: each plan in flight, and the one to be sent, counts as much as the dearest plan so far. Before one is known the
  first call goes alone. A budget is overrun only by what plans in flight cost more than the dearest before them.

Money is counted where the endpoint's price is known (`planners.pricing`) or was given. A call that failed is one
request, also where it was a plan's repair turn; one that failed after the model had probably worked on it (no answer in
time, broken off, unreadable) costs as much as the dearest plan.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto
from typing import Any, Self

from chauffeur.concept import ConfigError, Usage


@dataclass(frozen=True, slots=True)
class Price:
    """USD per million tokens, in and out."""

    prompt_usd: float
    completion_usd: float

    @classmethod
    def parse(cls, text: str) -> Self:
        """A price from `IN/OUT`, e.g. `2.5/10`. Raises ConfigError."""
        try:
            prompt, completion = (float(part) for part in text.split("/"))
            valid = 0.0 <= prompt < 1e6 and 0.0 <= completion < 1e6
        except ValueError:
            prompt = completion = 0.0
            valid = False
        if not valid:
            raise ConfigError(
                f"{text!r} is no price.", hint="Give USD per million tokens in and out, e.g. --price 2.5/10."
            )
        return cls(prompt, completion)

    def of(self, usage: Usage) -> float:
        """Price of a plan in USD; nothing for one that was answered from the cache."""
        if usage.cached:
            return 0.0
        return (usage.prompt_tokens * self.prompt_usd + usage.completion_tokens * self.completion_usd) / 1e6


@dataclass(frozen=True, slots=True)
class SpendingBudget:
    """Bounds of a run, over all its resumptions; None for none."""

    max_usd: float | None = None
    max_requests: int | None = None


@dataclass(slots=True)
class Bill:
    """Requests and money spent."""

    requests: int = 0
    usd: float = 0.0

    def add(self, other: Bill) -> None:
        """Spend more."""
        self.requests += other.requests
        self.usd += other.usd

    @classmethod
    def read(cls, row: dict[str, Any]) -> Self:
        """The bill in a stored row; nothing where there is none."""
        spent = row.get("spent") or {}
        return cls(int(spent.get("requests", 0)), float(spent.get("usd", 0.0)))


class Room(Enum):
    """Room for another call: yes; not before one in flight has settled; no more at all."""

    YES = auto()
    LATER = auto()
    NONE = auto()


@dataclass(slots=True)
class Spending:
    """A run's account.

    Attributes:
        budget: Its bounds.
        total: Spent so far, earlier runs in the same folder included.
        dearest_usd: Dearest plan so far; None before one is known.
        requests_a_plan: Most requests one plan may take.
        in_flight: Plans sent and not settled.
    """

    budget: SpendingBudget
    total: Bill
    dearest_usd: float | None = None
    requests_a_plan: int = 2
    in_flight: int = 0

    def room(self) -> Room:
        """Room for one more plan."""
        if self._over():
            return Room.NONE if self.in_flight == 0 else Room.LATER
        return Room.YES

    def _over(self) -> bool:
        budget, total = self.budget, self.total
        if (
            budget.max_requests is not None
            and total.requests + self.in_flight * self.requests_a_plan + 1 > budget.max_requests
        ):
            return True
        if budget.max_usd is None:
            return False
        if self.dearest_usd is None:
            return self.in_flight > 0 or total.usd >= budget.max_usd
        expected = total.usd + (self.in_flight + 1) * self.dearest_usd
        return expected > budget.max_usd or total.usd >= budget.max_usd

    def spent(self) -> str:
        """Reason, in words, for sending nothing more."""
        budget, total = self.budget, self.total
        if budget.max_requests is not None and total.requests + 1 > budget.max_requests:
            return f"The budget of {budget.max_requests:,} requests is used up ({total.requests:,} sent)."
        return (
            f"The budget of {budget.max_usd:g} USD has no room for another call ({total.usd:.4f} USD spent, "
            f"the dearest plan cost {self.dearest_usd or 0.0:.4f})."
        )

    def sent(self) -> None:
        """A plan was asked for."""
        self.in_flight += 1

    def settled(self, usage: Usage) -> Bill:
        """A plan is there; returns what it cost, money as 0 where no price is known."""
        usd = usage.cost_usd or 0.0
        if usage.requests:
            self.dearest_usd = max(self.dearest_usd or 0.0, usd)
        return self._settle(Bill(usage.requests, usd))

    def failed(self, requests: int, *, worked: bool) -> Bill:
        """No plan came; returns what that is taken to have cost.

        Args:
            requests: Requests it is known to have taken.
            worked: Whether a model had probably worked on it.
        """
        return self._settle(Bill(requests, self.dearest_usd or 0.0 if worked else 0.0))

    def _settle(self, bill: Bill) -> Bill:
        self.in_flight -= 1
        self.total.add(bill)
        return bill
