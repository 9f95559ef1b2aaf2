"""Budgets are kept with what is in flight counted, and what a run spent is remembered."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field

import numpy as np
import pytest
from virtual import run_virtually

from chauffeur.bench.kernel.budget import Bill, Price, Room, Spending, SpendingBudget
from chauffeur.bench.kernel.calls import FRUITLESS, Answer, Caller, Patience
from chauffeur.bench.kernel.pace import Gate, Window
from chauffeur.concept import (
    ConfigError,
    Context,
    Instruction,
    Plan,
    PlannerError,
    PlanRequest,
    Program,
    Situation,
    SystemMessage,
    Thoughts,
    Usage,
)
from chauffeur.planners.llm_errors import EndpointError

REQUEST = PlanRequest(
    Instruction("hold"),
    Context("", Situation("highway", 25.0, 31.3, 2, 1, False, None, None)),
    SystemMessage("You drive."),
)


def _plan(usage: Usage) -> Plan:
    return Plan(Thoughts("."), Program("."), model="m", usage=usage)


@dataclass
class Model:
    """A planner with a price list of its own; counts what it was really asked."""

    usages: list[Usage] = field(default_factory=lambda: [Usage(1000, 100, 0.01, 1)])
    faults: list[Exception] = field(default_factory=list)
    id: str = "model"
    model: str = "m"
    asked: int = 0
    requests: int = 0
    usd: float = 0.0

    async def plan(self, request: PlanRequest) -> Plan:
        usage = self.usages[self.asked % len(self.usages)]
        self.asked += 1
        await asyncio.sleep(1.0)
        if self.faults:
            raise self.faults.pop(0)
        self.requests += usage.requests
        self.usd += usage.cost_usd or 0.0
        return _plan(usage)


def _ask(model: Model, budget: SpendingBudget, plans: int, total: Bill | None = None, **options: object) -> tuple:
    async def work() -> tuple[list[Answer | None], Caller]:
        spending = Spending(budget, total or Bill())
        caller = Caller(model, Gate(Window(16)), spending, np.random.default_rng(0), **options)
        return list(await asyncio.gather(*(caller.ask(REQUEST) for _ in range(plans)))), caller

    return run_virtually(work())


@pytest.mark.parametrize("budget", [0, 1, 2, 3, 17, 40])
def test_requests_stay_within_the_budget_but_for_one_repair_turn(budget: int) -> None:
    one, two = Usage(10, 10, 0.0, 1), Usage(20, 20, 0.0, 2)
    for usages, over in (([one], 0), ([one, two, two], 1)):
        model = Model(usages)
        answers, caller = _ask(model, SpendingBudget(max_requests=budget), 60)
        assert budget - 1 <= model.requests <= budget + over, usages
        assert caller.spending.total.requests == model.requests
        assert answers.count(None) == 60 - model.asked
        assert caller.halt is not None and caller.halt.budget and f"{budget} requests" in caller.halt.why


def test_money_stays_within_the_budget_but_for_what_dearer_plans_cost_more() -> None:
    model = Model([Usage(10, 10, 0.01, 1), Usage(10, 10, 0.02, 1), Usage(10, 10, 0.005, 1)])
    _, caller = _ask(model, SpendingBudget(max_usd=0.5), 100)
    assert 0.5 - 0.04 <= model.usd <= 0.5
    assert caller.spending.total.usd == pytest.approx(model.usd)
    assert caller.halt is not None and "0.5 USD" in caller.halt.why


def test_the_first_call_goes_alone_when_its_price_is_not_known() -> None:
    model = Model([Usage(10, 10, 4.0, 1)])
    answers, _ = _ask(model, SpendingBudget(max_usd=1.0), 16)
    assert model.asked == 1, "one call told that another would be too dear"
    assert sum(answer is not None for answer in answers) == 1


def test_a_larger_budget_goes_on_where_the_last_stopped() -> None:
    model = Model()
    _, first = _ask(model, SpendingBudget(max_requests=10), 30)
    _, second = _ask(model, SpendingBudget(max_requests=25), 30, first.spending.total)
    assert model.requests == 25 == second.spending.total.requests


def test_answers_from_the_cache_cost_nothing() -> None:
    model = Model([Usage(1000, 100, 0.0, 0, cached=True)])
    answers, caller = _ask(model, SpendingBudget(max_requests=5, max_usd=1.0), 50)
    assert None not in answers and caller.halt is None


def test_money_cannot_be_kept_to_without_a_price() -> None:
    model = Model([Usage(1000, 100, None, 1)])
    answers, caller = _ask(model, SpendingBudget(max_usd=1.0), 20)
    assert caller.halt is not None and "--price" in caller.halt.hint and caller.halt.budget
    assert model.asked == 1
    assert answers[0] is not None and answers[0].reply is not None, "what was paid for is kept"

    answers, caller = _ask(
        Model([Usage(1000, 100, None, 1)]), SpendingBudget(max_usd=1.0), 20, price=Price(10.0, 100.0)
    )
    assert caller.halt is None
    assert [answer.reply.usage.cost_usd for answer in answers] == [pytest.approx(0.02)] * 20
    assert caller.spending.total.usd == pytest.approx(0.4)


def test_prices_are_read() -> None:
    assert Price.parse("2.5/10") == Price(2.5, 10.0)
    assert Price.parse("2.5/10").of(Usage(1_000_000, 100_000, None, 1)) == pytest.approx(3.5)
    assert Price.parse("2.5/10").of(Usage(1_000_000, 100_000, None, 0, cached=True)) == 0.0
    for text in ("", "1", "a/b", "1/2/3", "-1/2", "nan/1"):
        with pytest.raises(ConfigError, match="no price"):
            Price.parse(text)


def test_failures_that_pass_are_tried_again_and_paid_for_once() -> None:
    broken = EndpointError("server", "It failed (500).", retryable=True)
    limit = EndpointError("rate_limit", "Slow down.", retryable=True)
    model = Model(faults=[limit, limit, broken, PlannerError("Hiccup.", retryable=True)])
    answers, caller = _ask(model, SpendingBudget(), 1)
    assert answers[0].reply is not None
    assert answers[0].bill.requests == 4, "two refusals, a failure, an answer; a hiccup of its own is no request"
    assert caller.spending.total == answers[0].bill
    assert caller.spending.in_flight == 0 == caller.gate.in_flight


def test_a_request_that_was_alone_is_not_sent_again_after_a_time_out_and_one_beside_others_is_counted() -> None:
    timeout = EndpointError("timeout", "Too slow.", retryable=True)
    alone = Model(faults=[timeout])
    answers, caller = _ask(alone, SpendingBudget(), 1)
    assert (answers[0].reply, alone.asked, caller.repeated) == (None, 1, 0)
    assert "Not asked again" in answers[0].error
    several = Model(faults=[timeout])
    answers, caller = _ask(several, SpendingBudget(), 3)
    assert all(answer.reply is not None for answer in answers)
    assert (several.asked, caller.repeated) == (4, 1)


def test_a_plan_that_keeps_failing_is_given_up_and_the_others_go_on() -> None:
    @dataclass
    class Moody(Model):
        async def plan(self, request: PlanRequest) -> Plan:
            if request.instruction.text == "bad":
                raise EndpointError("server", "It failed (500).", retryable=True)
            return await Model.plan(self, request)

    bad = PlanRequest(Instruction("bad"), REQUEST.context, REQUEST.system)

    async def work() -> tuple[Answer, list[Answer], Caller]:
        caller = Caller(
            Moody(),
            Gate(Window(4)),
            Spending(SpendingBudget(), Bill()),
            np.random.default_rng(0),
            patience=Patience(attempts=3),
        )
        asked = [caller.ask(bad), *(caller.ask(REQUEST) for _ in range(40))]
        first, *others = await asyncio.gather(*asked)
        return first, others, caller

    first, others, caller = run_virtually(work())
    assert first.reply is None and "It failed (500)" in first.error and first.bill.requests == 3
    assert all(answer.reply is not None for answer in others) and caller.halt is None


@pytest.mark.parametrize("kind", ["unauthorized", "not_found", "quota", "no_key"])
def test_an_endpoint_that_refuses_everything_is_asked_once(kind: str) -> None:
    model = Model(faults=[EndpointError(kind, "It will never work.", hint="Get a key.") for _ in range(1000)])
    answers, caller = _ask(model, SpendingBudget(), 500)
    assert model.asked <= 16, "what was in flight, and no more"
    assert caller.halt is not None and not caller.halt.budget and caller.halt.hint == "Get a key."
    assert sum(answer is None for answer in answers) >= 484


@pytest.mark.parametrize(("asked_s", "stops"), [(60.0, False), (86_400.0, True)])
def test_a_wait_until_tomorrow_ends_the_run_and_a_minute_is_waited(asked_s: float, stops: bool) -> None:
    error = EndpointError("rate_limit", "Daily limit (429).", retryable=True, retry_after_s=asked_s)
    model = Model(faults=[error])

    async def work() -> tuple[list[Answer | None], Caller, float]:
        caller = Caller(model, Gate(Window(4)), Spending(SpendingBudget(), Bill()), np.random.default_rng(0))
        answers = list(await asyncio.gather(*(caller.ask(REQUEST) for _ in range(40))))
        return answers, caller, asyncio.get_running_loop().time()

    answers, caller, took_s = run_virtually(work())
    assert (caller.halt is not None) == stops
    if stops:
        assert caller.halt is not None and "asks to wait 86400 s" in caller.halt.why and took_s < 60
        assert None in answers
    else:
        assert all(answer is not None and answer.reply is not None for answer in answers) and took_s > 60


def test_an_endpoint_that_is_gone_ends_the_run_and_not_every_item() -> None:
    model = Model(faults=[EndpointError("unreachable", "Nobody there.", retryable=True) for _ in range(10_000)])
    answers, caller = _ask(model, SpendingBudget(), 48)
    assert caller.halt is not None and "Nobody there" in caller.halt.why and not caller.halt.budget
    assert FRUITLESS <= model.asked <= 48 * 6
    assert all(answer is None or answer.reply is None for answer in answers)


def test_a_planner_that_raises_anything_loses_one_item() -> None:
    model = Model(faults=[ValueError("what?"), KeyError("x")])
    answers, caller = _ask(model, SpendingBudget(), 10)
    failed = [answer for answer in answers if answer.reply is None]
    assert len(failed) == 2 and "ValueError: what?" in failed[0].error
    assert caller.halt is None and caller.spending.in_flight == 0


def test_room_is_counted_with_what_is_in_flight() -> None:
    spending = Spending(SpendingBudget(max_requests=4), Bill(requests=1))
    assert spending.room() is Room.YES
    spending.sent()
    assert spending.room() is Room.YES, "1 + 2 in flight + 1"
    spending.sent()
    assert spending.room() is Room.LATER, "1 + 4 in flight + 1"
    spending.settled(Usage(requests=1))
    spending.settled(Usage(requests=2))
    assert spending.room() is Room.NONE and "4 requests" in spending.spent()
