"""The planner against servers as they are: streaming or not, contexts too small in their own words, slow, one slot."""

from __future__ import annotations

import json

import pytest
from server import REPLY, events, fails, silent, stream, whole

from chauffeur.concept import ConfigError, Limits, Program
from chauffeur.planners import make_planner
from chauffeur.planners.llm_errors import EndpointError
from chauffeur.planners.llm_settings import VARIABLES, LlmSettings, settings_from
from chauffeur.planners.prompts import build_system_message

pytestmark = pytest.mark.server

FAST_REPLY = REPLY.replace("25.0", "95.0")


def test_a_server_that_answers_whole_although_asked_for_a_stream(server, bench):
    streamed = bench.plan()
    server.script(whole(REPLY))
    heard: list[str] = []
    plan = bench.plan(stream=True, on_text=lambda text, number: heard.append(text))
    assert (plan.policy, plan.usage) == (streamed.policy, streamed.usage)
    assert "".join(heard) == REPLY and len(server.requests) == 2


@pytest.mark.parametrize(
    ("streamed", "status", "said"),
    [
        (True, 400, "Streaming is not supported by this model."),
        (True, 501, "stream=true is not implemented"),
        (False, 400, "This model only support stream mode, please enable the stream parameter to access the model."),
        (False, 422, "stream must be true"),
    ],
)
def test_a_server_that_refuses_the_way_it_is_asked_is_asked_the_other_way(server, bench, streamed, status, said):
    server.script(fails(status, said), whole(REPLY) if streamed else stream(REPLY))
    assert isinstance(bench.plan(stream=streamed).policy, Program)
    assert [request.body.get("stream", False) for request in server.requests] == [streamed, not streamed]


def test_a_server_that_refuses_both_ways_is_not_asked_for_ever(server, bench):
    server.script(fails(400, "stream: no"))
    with pytest.raises(EndpointError) as caught:
        bench.plan()
    assert caught.value.kind == "bad_request" and len(server.requests) == 2


def test_an_empty_stream_is_asked_for_whole_where_the_server_says_what_is_wrong(server, bench):
    words = (
        "This model's maximum context length is 2048 tokens. However, you requested 2826 tokens (2426 in the messages)."
    )
    server.script(events(), fails(400, words, code="context_length_exceeded"))
    with pytest.raises(EndpointError, match=r"2,426 tokens.* the context is 2,048") as caught:
        bench.plan()
    assert caught.value.kind == "context"


def raw(status: int, value: object):
    data = json.dumps(value).encode()

    def answer(exchange) -> None:
        exchange.head(status, "application/json", Content_Length=str(len(data)))
        exchange.write(data)

    return answer


CONTEXTS = {
    "llama.cpp": raw(400, {"error": {
        "message": "request (2547 tokens) exceeds the available context size (2048 tokens), try increasing it",
        "code": 400, "type": "exceed_context_size_error", "n_prompt_tokens": 2547, "n_ctx": 2048}}),
    "llama.cpp, before": raw(400, {"error": {
        "code": 400, "message": "the request exceeds the available context size. try increasing the context size",
        "type": "exceed_context_size_error", "n_prompt_tokens": 2547, "n_ctx": 2048}}),
    "llama-cpp-python": fails(400,
        "This model's maximum context length is 2048 tokens. However, you requested 6643 tokens (2547 "
        "in the messages, 4096 in the completion). Please reduce the length of the messages or completion."),
    "vLLM": raw(400, {"object": "error", "type": "BadRequestError", "code": 400, "message":
        "This model's maximum context length is 2048 tokens. However, you requested 6643 tokens (2547 in the messages, "
        "4096 in the completion). Please reduce the length of the messages or completion."}),
    "vLLM, later": fails(400,
        "'max_tokens' or 'max_completion_tokens' is too large: 4096. This model's maximum context length is 2048 "
        "tokens and your request has 2547 input tokens (4096 > 2048 - 2547)."),
    "vLLM, now": fails(400,
        "You passed 2547 input tokens and requested 4096 output tokens. However, the model's context length is "
        "only 2048 tokens, resulting in a maximum input length of 0 tokens."),
    "SGLang": fails(400, "The input (2547 tokens) is longer than the model's context length (2048 tokens)."),
    "OpenAI": fails(400, "This model's maximum context length is 2048 tokens. However, your messages resulted in 2547 "
        "tokens. Please reduce the length of the messages.", code="context_length_exceeded"),
}  # fmt: skip


@pytest.mark.parametrize("name", CONTEXTS)
def test_a_context_too_small_is_said_with_its_numbers_and_what_to_do(server, bench, name):
    server.script(CONTEXTS[name])
    with pytest.raises(EndpointError) as caught:
        bench.plan()
    error = caught.value
    assert (error.kind, error.retryable) == ("context", False)
    assert "it needs 2,547 tokens" in error.message and error.message.endswith("the context is 2,048.")
    assert "4,096 tokens or more" in error.hint and "zero-shot" in error.hint
    assert len(server.requests) == 1


@pytest.mark.parametrize(
    "said",
    [
        "prompt too long; exceeded max context length by 120 tokens",
        "The number of tokens to keep from the initial prompt is greater than the context length.",
    ],
)
def test_a_context_too_small_without_numbers_is_said_with_an_estimate(server, bench, make_request, said):
    server.script(fails(400, said))
    asked = make_request("go")
    with pytest.raises(EndpointError, match=r"it needs about .* the context is smaller"):
        bench.plan(asked=asked)


def test_where_only_the_answer_is_too_long_it_is_asked_for_shorter_and_that_is_said(server, bench, caplog):
    words = "This model's maximum context length is 4096 tokens and your request has 2547 input tokens."
    server.script(fails(400, f"'max_tokens' is too large: 4096. {words}", param="max_tokens"), stream(REPLY))
    assert isinstance(bench.plan().policy, Program)
    assert [request.body["max_tokens"] for request in server.requests] == [4096, 1548]
    assert "leaves the answer 1,548 tokens" in caplog.text


def test_a_prompt_that_was_cut_without_a_word_is_told_of(server, bench, make_request, caplog):
    from dataclasses import replace

    server.script(whole(REPLY, usage=(2048, 90)))
    asked = replace(make_request("hold 25 m/s"), system=build_system_message("few-shot"))
    bench.plan(asked=asked)
    assert "counted 2,048 tokens" in caplog.text and "OLLAMA_CONTEXT_LENGTH" in caplog.text
    caplog.clear()
    server.script(whole(REPLY, usage=(3741, 90)))
    bench.plan(asked=asked)
    assert "counted" not in caplog.text


def test_a_program_over_the_limits_gets_its_repair_turn(server, bench):
    server.script(stream(FAST_REPLY), stream(REPLY))
    plan = bench.plan()
    assert "95.0" not in plan.policy.source
    told = server.requests[1].body["messages"][3]["content"]
    assert "| - line 3: A target speed of" in told and "above the speed limit" in told


def test_a_program_within_a_person_s_own_limits_only_after_repair(server, bench, make_request):
    server.script(stream(REPLY), stream(REPLY.replace("25.0", "20.0")))
    plan = bench.plan(asked=make_request("go", limits=Limits(max_speed_mps=22.0)))
    assert "20.0" in plan.policy.source and len(server.requests) == 2


@pytest.mark.parametrize(
    ("wish", "intent", "settings"),
    [
        ("hold 25 m/s", "speed.set", (("target_speed_mps", 25.0),)),
        ("change to the left lane", "lane.left", ()),
        ("overtake the car on the left", "", ()),  # there is none ahead
        ("go faster", "speed.increase", ()),
        ("tell me a story", "", ()),
    ],
)
def test_a_plan_carries_the_goal_of_the_wish_by_which_it_is_judged(bench, wish, intent, settings):
    plan = bench.plan(wish)
    assert plan.intent == intent
    assert tuple(pair for pair in plan.settings if pair[0] == "target_speed_mps") == settings


def test_the_prompt_is_what_is_sent_and_needs_no_key(server, bench, make_request):
    asked = make_request("hold 25 m/s")
    bench.plan(asked=asked)
    bench.environ = {}
    prompt = bench.planner(url="https://models.example/v1").prompt(asked)
    assert prompt.url == "https://models.example/v1/chat/completions"
    assert {**prompt.parameters, "messages": prompt.messages} == server.requests[0].body


def test_settings_come_from_the_environment_and_what_is_given_counts_more():
    environ = {
        "CHAUFFEUR_TIMEOUT_S": "600",
        "CHAUFFEUR_MAX_TOKENS": "800",
        "CHAUFFEUR_ATTEMPTS": "2",
        "CHAUFFEUR_REPAIRS": "0",
        "CHAUFFEUR_TEMPERATURE": "server",
    }
    found = settings_from(environ, {})
    assert found == LlmSettings(temperature=None, max_tokens=800, timeout_s=600.0, attempts=2, repairs=0)
    assert found.plan_s == 600.0
    assert settings_from(environ, {"timeout_s": 5.0, "attempts": None}).timeout_s == 5.0
    assert settings_from({}, {}).plan_s == 180.0


@pytest.mark.parametrize(("name", "said"), [("timeout_s", "soon"), ("attempts", "1.5"), ("repairs", "9")])
def test_a_setting_that_is_none_is_refused_by_its_variable(monkeypatch, name, said):
    monkeypatch.setenv(VARIABLES[name], said)
    with pytest.raises(ConfigError, match=VARIABLES[name]):
        make_planner("openai/m", base_url="http://127.0.0.1:1/v1")


def test_the_environment_reaches_the_endpoint(server, monkeypatch, make_request, tmp_path):
    import asyncio

    monkeypatch.setenv("CHAUFFEUR_MAX_TOKENS", "321")
    monkeypatch.setenv("CHAUFFEUR_TIMEOUT_S", "0.2")
    server.script(silent(5.0))
    planner = make_planner("openai/m", base_url=server.url, cache_dir=tmp_path)

    async def run() -> None:
        try:
            await planner.plan(make_request("go"))
        finally:
            await planner.close()

    with pytest.raises(EndpointError, match=r"within 0\.2 s"):
        asyncio.run(run())
    assert server.requests[0].body["max_tokens"] == 321
