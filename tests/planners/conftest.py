"""What planner tests share: a scripted model server, and planners that wait for nothing."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from server import ModelServer

from chauffeur.concept import Context, Instruction, Plan, PlanRequest, Situation, SystemMessage
from chauffeur.concept.addresses import Address
from chauffeur.planners.llm import LlmPlanner
from chauffeur.planners.llm_model import ChatModel
from chauffeur.planners.llm_settings import parse_address

SECRET = "sk-test-0123456789abcdef-secret"


@pytest.fixture
def server() -> Iterator[ModelServer]:
    running = ModelServer()
    yield running
    running.close()


@dataclass
class Bench:
    """Makes planners whose waits are only written down, and runs them."""

    url: str
    waits: list[float] = field(default_factory=list)
    environ: dict[str, str] = field(default_factory=lambda: {"CHAUFFEUR_API_KEY": SECRET})

    def planner(
        self, model: str = "m", url: str | None = None, address: Address | None = None, **options: Any
    ) -> LlmPlanner:
        async def sleep(seconds: float) -> None:
            self.waits.append(seconds)

        settings: dict[str, Any] = {"gate": lambda source: [], "timeout_s": 5.0} | options
        own = {name: settings.pop(name) for name in ("gate", "repairs") if name in settings}
        where = address or parse_address(url or self.url, {})
        rng = np.random.default_rng(1)
        return LlmPlanner(ChatModel(model, where, rng=rng, environ=self.environ, sleep=sleep, **settings), **own)

    def plan(self, words: str = "hold 25 m/s", *, asked: PlanRequest | None = None, **options: Any) -> Plan:
        async def run() -> Plan:
            planner = self.planner(**options)
            try:
                return await planner.plan(asked or request(words))
            finally:
                await planner.close()

        return asyncio.run(run())


@pytest.fixture
def bench(server: ModelServer) -> Bench:
    return Bench(server.url)


def request(words: str, **fields: Any) -> PlanRequest:
    situation = Situation("highway", 25.0, 31.3, 2, 1, False, None, None)
    context = Context("My current speed is 25.0 m/s.", situation)
    return PlanRequest(Instruction(words), context, SystemMessage("You drive."), **fields)


@pytest.fixture
def make_request() -> Callable[..., PlanRequest]:
    return request


@pytest.fixture
def secret() -> str:
    return SECRET
