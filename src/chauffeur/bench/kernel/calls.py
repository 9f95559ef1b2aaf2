"""Asking a planner on behalf of a run: paced, within a budget, again where that can help, and not for ever."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final, cast

from chauffeur.bench.kernel.budget import Bill, Price, Room, Spending
from chauffeur.bench.kernel.pace import Gate, Signal
from chauffeur.concept import ChauffeurError, Plan, PlannerError, PlanRequest
from chauffeur.planners.base import Answerer, Planner, Prose
from chauffeur.planners.llm_errors import EndpointError, Kind
from chauffeur.planners.prompts import Message
from chauffeur.planners.transcript import ModelTurn, kept_turns

if TYPE_CHECKING:
    import numpy as np

_log = logging.getLogger(__name__)

FRUITLESS: Final = 5
"""Plans in a row given up by the endpoint's fault, none had in between, before a run stops asking."""
FRUITLESS_BAD: Final = 20
"""The same for requests it calls bad, which may be the items' own fault."""

TOO_LONG_S: Final = 900.0
"""An endpoint that asks to wait longer than this, e.g. for its next day, ends the asking."""

_SIGNALS: Final[dict[Kind, Signal]] = {
    "rate_limit": "refused",
    "server": "overloaded",
    "timeout": "slow",
    "dns": "unreachable",
    "unreachable": "unreachable",
    "broken": "overloaded",
    "truncated": "neither",
    "garbage": "neither",
}
_WORKED: Final[frozenset[Kind]] = frozenset({"timeout", "truncated", "garbage", "broken"})
_HOPELESS: Final[frozenset[Kind]] = frozenset(
    {"no_key", "unauthorized", "forbidden", "not_found", "quota", "not_an_api", "context"}
)
"""The next call would fail the same way, whatever is asked."""


Request = PlanRequest | Sequence[Message]
"""Kinds of request: a plan, or words to a conversation."""

Reply = Plan | Prose


@dataclass(frozen=True, slots=True)
class Patience:
    """Retry limits and waits of one plan in a run.

    Attributes:
        attempts: Calls that may fail in ways that pass.
        refusals: Times the endpoint may turn it away (429), which says little about the plan: the window answers to it.
        base_s: Wait after the first failure; doubles each time.
        cap_s: Longest wait.
    """

    attempts: int = 6
    refusals: int = 40
    base_s: float = 0.5
    cap_s: float = 20.0


@dataclass(frozen=True, slots=True)
class Halt:
    """Reason for which a run stopped asking.

    Attributes:
        why: In words.
        hint: What to do.
        budget: Whether it was the budget; else the endpoint.
    """

    why: str
    hint: str
    budget: bool


@dataclass(frozen=True, slots=True)
class Answer:
    """A plan or words, or why there are none, what that cost, and the last conversation with the model about it."""

    reply: Reply | None
    error: str
    bill: Bill
    turns: tuple[ModelTurn, ...] = ()


@dataclass(slots=True)
class Caller:
    """Asks a planner for plans, or a model for words.

    Attributes:
        planner: Who is asked; it should not retry by itself, or its waits stay unseen here.
        gate: Bounds what is in flight.
        spending: The account.
        rng: Jitter of the waits.
        price: For planners that do not know what they cost.
        patience: How often one plan is tried.
        halt: Set once nothing more is sent.
        repeated: Calls sent again, word for word, after a time-out.
    """

    planner: Planner | Answerer
    gate: Gate
    spending: Spending
    rng: np.random.Generator
    price: Price | None = None
    patience: Patience = field(default_factory=Patience)
    halt: Halt | None = None
    repeated: int = 0
    _fruitless: int = 0
    _settled: asyncio.Event = field(default_factory=asyncio.Event)

    async def ask(self, request: Request) -> Answer | None:
        """One reply, or why there is none; None when it was not asked for, because the run has stopped asking.

        No fault of planner or endpoint raises.
        """
        bill = Bill()
        last = ""
        failures = refusals = 0
        turns: list[ModelTurn] = []
        while (sent_s := await self._turn()) is not None:
            with kept_turns() as heard:
                outcome = await self._call(request, sent_s, bill)
            turns = heard
            if isinstance(outcome, Reply):
                self._fruitless = 0
                return Answer(outcome, "", bill, tuple(turns))
            last = str(outcome)
            refused = isinstance(outcome, EndpointError) and outcome.kind == "rate_limit"
            refusals += refused
            failures += not refused
            again = failures < self.patience.attempts and refusals < self.patience.refusals
            if not (outcome.retryable and again and _asked_s(outcome) <= TOO_LONG_S):
                self._given_up(outcome)
                return Answer(None, last, bill, tuple(turns))
            self.repeated += isinstance(outcome, EndpointError) and outcome.kind == "timeout"
            if not refused:
                wait_s = min(self.patience.cap_s, self.patience.base_s * 2.0 ** (failures - 1))
                await asyncio.sleep(wait_s * float(self.rng.uniform(0.5, 1.0)))
        return Answer(None, last, bill, tuple(turns)) if last else None

    async def _turn(self) -> float | None:
        """Wait for a place and for room in the budget; when the call is sent, or None when none may be any more."""
        sent_s = await self.gate.enter()
        try:
            while self.halt is None:
                room = self.spending.room()
                if room is Room.YES:
                    self.spending.sent()
                    return asyncio.get_running_loop().time()
                if room is Room.NONE:
                    self._stop(self.spending.spent(), "Go on with the same command and a larger budget.", budget=True)
                    break
                self._settled.clear()
                await self._settled.wait()
        except BaseException:
            self.gate.leave("neither", sent_s)
            raise
        self.gate.leave("neither", sent_s)
        return None

    async def _call(self, request: Request, sent_s: float, bill: Bill) -> Reply | ChauffeurError:
        signal: Signal = "neither"
        asked_s = None
        try:
            outcome = await self._reply(request)
        except BaseException:
            self.spending.failed(0, worked=False)
            self.gate.leave(signal, sent_s)
            raise
        if isinstance(outcome, Reply):
            signal = "answered"
            bill.add(self.spending.settled(outcome.usage))
        elif isinstance(outcome, EndpointError):
            signal = _SIGNALS.get(outcome.kind, "neither")
            if (
                outcome.kind == "timeout" and self.gate.in_flight == 1
            ):  # with fewer beside it, it may be quicker; not so here
                outcome = outcome.not_again("nothing else was asked beside it, so that it would take as long")
            asked_s = outcome.retry_after_s
            bill.add(self.spending.failed(1, worked=outcome.kind in _WORKED))
        else:
            self.spending.failed(0, worked=False)
        self.gate.leave(signal, sent_s, asked_s)
        self._settled.set()
        return outcome

    async def _reply(self, request: Request) -> Reply | ChauffeurError:
        try:
            if isinstance(request, PlanRequest):
                return self._priced(await cast("Planner", self.planner).plan(request))
            return self._priced(await cast("Answerer", self.planner).write(request))
        except ChauffeurError as error:
            return error
        except Exception as error:  # noqa: BLE001 - a plug-in may raise anything, and one bad item never loses a run
            _log.exception("the planner failed in a way of its own")
            return PlannerError(f"The planner itself failed: {type(error).__name__}: {error}.")

    def _priced(self, reply: Reply) -> Reply:
        usage = reply.usage
        if usage.cost_usd is None and self.price is not None:
            return replace(reply, usage=replace(usage, cost_usd=self.price.of(usage)))
        if usage.cost_usd is None and usage.requests and self.spending.budget.max_usd is not None:
            self._stop(
                f"What {reply.model or self.planner.id} costs is not known, so --max-usd cannot be kept.",
                "Give its price with --price IN/OUT (USD per million tokens), or bound --max-requests.",
                budget=True,
            )
        return reply

    def _given_up(self, error: ChauffeurError) -> None:
        """Stop asking when it is the endpoint that fails and not this request."""
        if not isinstance(error, EndpointError) or error.kind == "no_vision":  # said of each item, at no cost
            return
        self._fruitless += 1
        bad = error.kind == "bad_request"
        if _asked_s(error) > TOO_LONG_S:
            self._stop(f"{error.message} It asks to wait {error.retry_after_s:.0f} s.", "Run the same command then.")
        elif error.kind in _HOPELESS or self._fruitless >= (FRUITLESS_BAD if bad else FRUITLESS):
            hint = error.hint or "Put it right and run the same command: it goes on where it stopped."
            self._stop(error.message, hint)

    def _stop(self, why: str, hint: str, *, budget: bool = False) -> None:
        """Send nothing any more; the first reason stands. Whoever waits for a place or for room learns it."""
        self.halt = self.halt or Halt(why, hint, budget)
        self.gate.open()
        self._settled.set()


def _asked_s(error: ChauffeurError) -> float:
    """Wait that the endpoint asked for, s; 0 where it named none."""
    return error.retry_after_s or 0.0 if isinstance(error, EndpointError) else 0.0
