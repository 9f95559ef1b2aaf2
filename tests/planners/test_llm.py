"""The planner against a real server that behaves."""

from __future__ import annotations

import asyncio
import json

import pytest
from server import PROGRAM, REPLY, events, fails, stream, whole

from chauffeur.concept import Feedback, History, HistoryItem, InstructionError, Program, Round
from chauffeur.concept.addresses import Address
from chauffeur.planners.cache import ReplyCache
from chauffeur.planners.llm import INTENT_DECLINED, INTENT_UNUSABLE
from chauffeur.planners.llm_endpoint import Sampling

pytestmark = pytest.mark.server


def test_a_streamed_reply_becomes_a_plan_with_its_costs(server, bench):
    plan = bench.plan(model="m")
    assert plan.policy == Program(PROGRAM)
    assert plan.thoughts.text == "Hold 25 m/s."
    assert plan.refusal == "" and plan.intent == "speed.set"
    assert (plan.planner, plan.model) == ("openai/m", "served-1")
    assert plan.raw == REPLY
    assert (plan.usage.prompt_tokens, plan.usage.completion_tokens, plan.usage.requests) == (1000, 200, 1)
    assert plan.usage.cost_usd is None and not plan.usage.cached
    assert plan.latency_s > 0.0


def test_a_priced_model_says_what_it_cost_and_a_kept_reply_costs_nothing(server, bench, make_request, tmp_path):
    planner = bench.planner(
        "gpt-4o", address=Address(server.url, "api.openai.com", local=True), cache=ReplyCache(tmp_path)
    )
    first, kept = (asyncio.run(planner.plan(make_request("go"))).usage for _ in range(2))
    assert first.cost_usd == pytest.approx((1000 * 2.5 + 200 * 10.0) / 1e6)
    assert kept.cost_usd == 0.0


def test_a_whole_reply_gives_the_same_plan(server, bench):
    streamed = bench.plan()
    server.script(whole(REPLY))
    plan = bench.plan(stream=False)
    assert (plan.policy, plan.thoughts, plan.raw) == (streamed.policy, streamed.thoughts, streamed.raw)
    assert plan.usage == streamed.usage
    assert "stream" not in server.requests[-1].body


def test_the_request_holds_the_prompt_the_sampling_and_the_key(server, bench, secret):
    bench.plan(sampling=Sampling(temperature=0.3, seed=7, max_tokens=99))
    sent = server.requests[0]
    assert sent.path == "/v1/chat/completions"
    assert sent.headers["authorization"] == f"Bearer {secret}"
    assert (sent.body["temperature"], sent.body["seed"], sent.body["max_tokens"]) == (0.3, 7, 99)
    assert [message["role"] for message in sent.body["messages"]] == ["system", "user"]
    assert '<data name="instruction">\n| hold 25 m/s\n</data>' in sent.body["messages"][1]["content"]


def test_a_local_server_needs_no_key(server, bench):
    bench.environ.clear()
    assert bench.plan().policy is not None
    assert server.requests[0].headers["authorization"] == "Bearer none"


def test_text_arrives_while_it_is_written(server, bench):
    heard: list[tuple[str, int]] = []
    server.script(fails(500), stream(REPLY))
    bench.plan(on_text=lambda text, number: heard.append((text, number)))
    assert "".join(text for text, _ in heard) == REPLY
    assert {number for _, number in heard} == {2}
    assert len(heard) > 5


def test_a_display_that_fails_does_not_cost_the_plan(bench, caplog):
    def broken(text: str, number: int) -> None:
        raise ValueError("the terminal is gone")

    assert bench.plan(on_text=broken).policy is not None
    assert caplog.text.count("switched off") == 1


def test_a_refused_program_is_repaired_once(server, bench):
    worse = REPLY.replace("25.0", "250.0")
    server.script(stream(worse), stream(REPLY))
    plan = bench.plan(
        gate=lambda source: ["line 3: 250 m/s is too fast. Use at most 32 m/s."] if "250" in source else []
    )
    assert plan.policy == Program(PROGRAM)
    assert plan.usage.requests == 2 and plan.usage.prompt_tokens == 2000
    turns = server.requests[1].body["messages"]
    assert [turn["role"] for turn in turns] == ["system", "user", "assistant", "user"]
    assert "250.0" in turns[2]["content"]
    assert "| - line 3: 250 m/s is too fast." in turns[3]["content"]


def test_the_gate_of_the_driving_language_is_the_default(server, bench):
    server.script(stream(REPLY.replace("set_target_speed", "set_speed")), stream(REPLY))
    plan = bench.plan(gate=None)
    assert plan.policy == Program(PROGRAM)
    assert "| - line 3: set_speed is not defined; did you mean" in server.requests[1].body["messages"][3]["content"]


def test_a_program_refused_twice_is_handed_on_for_the_checks_to_refuse(server, bench):
    plan = bench.plan(gate=lambda source: ["line 1: no"])
    assert plan.policy == Program(PROGRAM)
    assert len(server.requests) == 2


def test_repairs_can_be_turned_off(server, bench):
    bench.plan(gate=lambda source: ["line 1: no"], repairs=0)
    assert len(server.requests) == 1


def test_a_model_that_declines_gives_a_refusal_and_is_not_asked_again(server, bench):
    server.script(stream("REFUSE: I only drive cars."))
    plan = bench.plan("sing a song")
    assert plan.policy is None
    assert plan.refusal == "I only drive cars."
    assert plan.intent == INTENT_DECLINED
    assert len(server.requests) == 1


def test_earlier_rounds_become_the_conversation(server, bench, make_request):
    item = HistoryItem("t", "2026", "faster", "ctx", "highway", "", "", "p", (("target_speed_mps", 28.0),),
                       (Feedback("that was nice"),), "success")  # fmt: skip
    asked = make_request("faster", history=History((item,)), rounds=(Round(PROGRAM, "still too slow"),))
    bench.plan(asked=asked)
    turns = server.requests[0].body["messages"]
    assert [turn["role"] for turn in turns] == ["system", "user", "assistant", "user"]
    assert "target_speed_mps = 28" in turns[1]["content"] and "that was nice" in turns[1]["content"]
    assert turns[2]["content"] == f"```python\n{PROGRAM}```"
    assert "| still too slow" in turns[3]["content"]


def test_an_empty_instruction_asks_nobody(server, bench):
    with pytest.raises(InstructionError):
        bench.plan("   ")
    assert server.requests == []


def test_many_plans_at_once_on_one_planner(server, bench, make_request):
    async def run():
        planner = bench.planner()
        plans = await asyncio.gather(*(planner.plan(make_request(f"wish {i}")) for i in range(20)))
        await planner.close()
        return plans

    assert all(plan.policy is not None and plan.usage.requests == 1 for plan in asyncio.run(run()))
    assert len(server.requests) == 20


def test_a_planner_outlives_its_event_loop(server, bench, make_request):
    server.script(whole(REPLY))
    planner = bench.planner(stream=False)
    for _ in range(2):
        assert asyncio.run(planner.plan(make_request("x"))).policy is not None
    assert bench.waits == []


@pytest.mark.parametrize(
    ("param", "gone", "instead"),
    [
        ("max_tokens", "max_tokens", "max_completion_tokens"),
        ("temperature", "temperature", None),
        ("stream_options", "stream_options", None),
    ],
)
def test_parameters_a_server_does_not_take_are_adapted_once(server, bench, make_request, param, gone, instead):
    server.script(fails(400, f"Unsupported parameter: '{param}'", param=param), stream(REPLY))

    async def run():
        planner = bench.planner()
        await planner.plan(make_request("a"))
        await planner.plan(make_request("b"))
        await planner.close()

    asyncio.run(run())
    assert len(server.requests) == 3
    for sent in server.requests[1:]:
        assert gone not in sent.body
        assert instead is None or sent.body[instead] == 4096
    assert bench.waits == []


@pytest.mark.parametrize(
    "text", ["", "   \n", "I would rather talk about the weather.", '{"a": [1, 2', "```python\n```"]
)
def test_a_reply_without_a_program_is_asked_for_again_and_then_given_up(server, bench, text):
    server.script(stream(text))
    plan = bench.plan()
    assert plan.policy is None and plan.intent == INTENT_UNUSABLE
    assert plan.refusal.startswith("The model gave no usable program")
    assert len(server.requests) == 2


def test_an_answer_cut_at_the_token_limit_is_not_driven(server, bench):
    server.script(stream(REPLY.rsplit("```", 1)[0], finish="length"), stream(REPLY))
    plan = bench.plan()
    assert plan.policy == Program(PROGRAM)
    assert "cut off" in server.requests[1].body["messages"][3]["content"]


def test_counts_that_arrive_twice_count_once(server, bench):
    from server import DONE, chunk

    server.script(
        events(
            chunk(REPLY), chunk(finish="stop"), chunk(finish="stop"), chunk(usage=(10, 5)), chunk(usage=(10, 5)), DONE
        )
    )
    plan = bench.plan()
    assert (plan.usage.prompt_tokens, plan.usage.completion_tokens) == (10, 5)


def test_duplicated_text_is_caught_by_the_gate_not_by_luck(server, bench):
    from server import DONE, chunk

    twice = [piece for i in range(0, len(REPLY), 9) for piece in (chunk(REPLY[i : i + 9]),) * 2]
    server.script(events(*twice, chunk(finish="stop"), DONE), stream(REPLY))

    def gate(source: str) -> list[str]:
        try:
            compile(source, "p", "exec")
        except SyntaxError:
            return ["line 1: not Python"]
        return []

    plan = bench.plan(gate=gate)
    assert plan.policy == Program(PROGRAM)
    assert len(server.requests) == 2


def test_no_client_is_imported_before_it_is_needed():
    import subprocess
    import sys

    code = (
        "import sys, json; import chauffeur.planners, chauffeur.planners.llm, chauffeur.planners.replay;"
        "print(json.dumps([n for n in ('httpx', 'numpy', 'pydantic') if n in sys.modules]))"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert json.loads(out) == []
