"""The on-board planner over HTTP, used by OpenAI's own client and by our `openai` planner, on a real socket."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator

import httpx
import openai
import pytest

from chauffeur.cli.serve import ServedEndpoint
from chauffeur.concept import Instruction, Limits, PlanRequest, Program, SystemMessage
from chauffeur.describe import describe
from chauffeur.planners.onboard import LanguageModelPlanner
from chauffeur.planners.onboard.language_model import SHIPPED
from chauffeur.planners.onboard.served import situation_of
from chauffeur.planners.registry import make_planner
from chauffeur.programs.gate import check_source
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.scenarios import BUILT_IN

pytestmark = pytest.mark.server


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    server = ServedEndpoint("127.0.0.1", 0, LanguageModelPlanner(SHIPPED), Limits())
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}/v1"
    server.shutdown()
    server.server_close()


@pytest.fixture
def client(address: str) -> openai.OpenAI:
    return openai.OpenAI(base_url=address, api_key="none", max_retries=0)


def test_openais_client_gets_a_program(client: openai.OpenAI) -> None:
    assert [model.id for model in client.models.list()] == ["onboard"]
    answer = client.chat.completions.create(
        model="onboard", messages=[{"role": "user", "content": "Please slow down to 20 m/s."}]
    )
    text = answer.choices[0].message.content or ""
    source = text.split("```python\n")[1].split("```")[0]
    assert "20 m/s" in text
    assert check_source(source).passed


def test_streamed_it_is_the_same_text(client: openai.OpenAI) -> None:
    words = [{"role": "user", "content": "Take the left lane."}]
    whole = client.chat.completions.create(model="onboard", messages=words)  # type: ignore[arg-type]
    stream = client.chat.completions.create(model="onboard", messages=words, stream=True)  # type: ignore[arg-type]
    pieces = [chunk.choices[0].delta.content or "" for chunk in stream if chunk.choices]
    assert len(pieces) > 3
    assert "".join(pieces) == whole.choices[0].message.content


def test_what_is_not_a_wish_is_refused_in_words(client: openai.OpenAI) -> None:
    answer = client.chat.completions.create(model="onboard", messages=[{"role": "user", "content": "Order a pizza."}])
    assert (answer.choices[0].message.content or "").startswith("REFUSE: ")


@pytest.mark.parametrize("scenario", BUILT_IN, ids=lambda scenario: scenario.id)
def test_our_llm_planner_plans_with_it_as_the_planner_does_itself(address: str, scenario: object) -> None:
    observation = HighwayWorld().reset(scenario)  # type: ignore[arg-type]
    context = describe(observation)
    request = PlanRequest(Instruction("Drive 3 m/s slower."), context, SystemMessage(""))
    there = asyncio.run(make_planner("openai/onboard", base_url=address).plan(request))
    here = asyncio.run(LanguageModelPlanner(SHIPPED).plan(request))
    assert (there.policy is None) == (here.policy is None)
    if isinstance(there.policy, Program):
        assert check_source(there.policy.source).passed
    read = situation_of(context.text)
    known = context.situation
    assert (read.world, read.lane_count, read.lane_index, read.emergency_lane, read.turns) == (
        known.world,
        known.lane_count,
        known.lane_index,
        known.emergency_lane,
        known.turns,
    )
    assert (read.front is None) == (known.front is None)
    assert read.speed_mps == pytest.approx(known.speed_mps, abs=0.06)


@pytest.mark.parametrize(
    ("body", "status"),
    [
        (b"no json", 400),
        (b"[]", 400),
        (b"{}", 400),
        (b'{"messages": [1]}', 400),
        (b'{"messages": []}', 400),
        (b'{"messages": [{"role": "user", "content": []}]}', 400),
    ],
)
def test_bad_requests_are_answered_in_words(address: str, body: bytes, status: int) -> None:
    answer = httpx.post(f"{address}/chat/completions", content=body)
    assert answer.status_code == status
    assert answer.json()["error"]["message"]


def test_other_paths_are_named(address: str) -> None:
    assert httpx.get(f"{address}/nothing").status_code == 404
    assert httpx.post(f"{address}/embeddings", json={"messages": []}).status_code == 404
    assert httpx.get(address.removesuffix("/v1") + "/health").json()["status"] == "ok"
