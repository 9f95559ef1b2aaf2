"""The endpoint client against servers that are loose with the protocol where its public clients are, too."""

from __future__ import annotations

import asyncio
import gzip
import io
import json
import time
import zlib
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
import zstandard
from server import DONE, PROGRAM, REPLY, Exchange, body, chunk, events, fails, stream, whole

from chauffeur.concept import Program
from chauffeur.planners.llm_errors import EndpointError
from chauffeur.planners.llm_model import ChatModel
from chauffeur.planners.llm_retry import RetryPolicy

pytestmark = pytest.mark.server

HALVES = (chunk(REPLY[:40]), chunk(REPLY[40:]))
ENDED = (*HALVES, chunk(finish="stop"), DONE)
HELD = Program(PROGRAM)


def raw(data: bytes):
    """An answer as it was recorded, head and all."""

    def answer(exchange: Exchange) -> None:
        exchange.write(data)
        exchange.close_connection = True

    return answer


def typed(content_type: str, *pieces: bytes, **headers: str):
    def answer(exchange: Exchange) -> None:
        exchange.head(200, content_type, **headers)
        for piece in pieces:
            exchange.write(piece)

    return answer


@pytest.fixture
def recorded(case_folder: Callable[[str], Path]):
    return lambda case, file="reply.http": raw((case_folder(case) / file).read_bytes())


def failure(bench, **options) -> EndpointError:
    with pytest.raises(EndpointError) as caught:
        bench.plan(retry=RetryPolicy(attempts=1), **options)
    return caught.value


# Recorded answers -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("case", "file"),
    [
        ("endpoint-bom", "reply.http"),
        ("endpoint-done-without-finish", "reply.http"),
        ("endpoint-wrong-content-type", "reply.http"),
        ("endpoint-wrong-content-type", "as-json.http"),
    ],
)
def test_recorded_streams_are_read_whole(server, bench, recorded, case, file):
    server.script(recorded(case, file))
    plan = bench.plan()
    assert isinstance(plan.policy, Program) and "set_target_speed(20)" in plan.policy.source
    assert len(server.requests) == 1


def test_a_recorded_error_list_is_told_in_its_words(server, bench, recorded):
    server.script(recorded("endpoint-error-list"))
    assert "API key not valid. Please pass a valid API key." in failure(bench).message


def test_a_recorded_dislike_of_the_system_turn_is_met(server, bench, recorded):
    server.script(recorded("endpoint-system-role"), stream(REPLY))
    assert bench.plan().policy == HELD
    first, second = (request.body["messages"] for request in server.requests)
    assert [turn["role"] for turn in first] == ["system", "user"]
    assert [turn["role"] for turn in second] == ["user"]
    assert second[0]["content"].startswith(first[0]["content"])
    assert second[0]["content"].endswith(first[1]["content"])


def test_a_recorded_refusal_is_the_model_s_own(server, bench, recorded):
    server.script(recorded("endpoint-refusal-field"))
    plan = bench.plan()
    assert (plan.policy, plan.refusal, plan.intent) == (None, "I can't help with that.", "declined")
    assert len(server.requests) == 1


def test_a_recorded_filtered_reply_is_said_to_be_one(server, bench, recorded):
    server.script(recorded("endpoint-refusal-field", "filter.http"))
    plan = bench.plan()
    assert plan.policy is None and "content filter" in plan.refusal
    assert len(server.requests) == 1


# Streams --------------------------------------------------------------------------------------------------------------

STREAMS = {
    "no content type": typed("", *ENDED),
    "binary": typed("application/octet-stream", *ENDED),
    "capital letters": typed("Text/Event-Stream", *ENDED),
    "JSON, it says": typed("application/json", *ENDED),
    "a byte order mark": events(b"\xef\xbb\xbf" + ENDED[0], *ENDED[1:]),
    "a byte order mark in pieces": events(b"\xef", b"\xbb", b"\xbf", *ENDED, pause_s=0.01),
    "blank lines first": events(b"\n\n\r\n", *ENDED),
    "a comment first": events(b": ping\n\n", *ENDED),
    "retry first": events(b"retry: 3000\n\n", *ENDED),
    "numbered events": events(b"id: 1\n" + ENDED[0], b": ping\n\n", b"id: 2\n" + ENDED[1], *ENDED[2:]),
    "pings": events(b"event: ping\n\n", ENDED[0], b"event: ping\ndata:\n\n", *ENDED[1:]),
    "[DONE] alone": events(*HALVES, DONE),
    "[DONE] without a blank": events(*HALVES, b"data:[DONE]\n\n"),
    "finish_reason alone": events(*HALVES, chunk(finish="stop")),
    "finish_reason with the words": events(HALVES[0], chunk(REPLY[40:], finish="stop"), DONE),
    "another word for the end": events(*HALVES, chunk(finish="eos"), DONE),
    "a line for the usage": events(*HALVES, chunk(finish="stop"), chunk(usage=(5, 5)), DONE),
}


@pytest.mark.parametrize("name", STREAMS)
@pytest.mark.parametrize("streamed", [True, False])
def test_a_stream_is_read_by_what_it_is(server, bench, name, streamed):
    server.script(STREAMS[name])
    assert bench.plan(stream=streamed).policy == HELD
    assert len(server.requests) == 1


def test_an_end_that_only_done_tells_is_remarked_upon(server, bench, caplog):
    server.script(events(*HALVES, DONE))
    bench.plan()
    assert "without a finish_reason" in caplog.text


@pytest.mark.parametrize("finish", ["length", "max_tokens", "MAX_TOKENS", "model_length", "abort", "unheard of"])
def test_an_end_by_any_limit_is_a_cut(server, bench, finish):
    server.script(events(chunk(REPLY.removesuffix("```\n")), chunk(finish=finish), DONE))
    plan = bench.plan()
    assert plan.policy is None and "cut off" in plan.refusal


def _message(**fields: object) -> bytes:
    return json.dumps({"choices": [{"index": 0, "message": fields, "finish_reason": "stop"}]}).encode()


def _delta(finish: str | None = None, **fields: object) -> bytes:
    return (
        b"data: " + json.dumps({"choices": [{"index": 0, "delta": fields, "finish_reason": finish}]}).encode() + b"\n\n"
    )


DRAFT = REPLY.replace("25.0", "31.0")


@pytest.mark.parametrize(
    "answer",
    [
        body(
            _message(content=[{"type": "text", "text": REPLY[:40]}, {"type": "text", "text": REPLY[40:]}]), "text/plain"
        ),
        body(
            _message(content=[{"type": "thinking", "thinking": DRAFT}, {"type": "text", "text": REPLY}]), "text/plain"
        ),
        body(
            _message(content=[{"type": "reasoning", "text": DRAFT}, {"type": "output_text", "text": REPLY}]), "a/json"
        ),
        body(_message(content=["", REPLY]), "application/json"),
        body(_message(content=REPLY, reasoning_content=DRAFT), "application/json"),
        body(_message(content=REPLY, reasoning=DRAFT, refusal=None), ""),
        body(b"\xef\xbb\xbf\n" + _message(content=REPLY), "application/json"),
        events(_delta(content=[{"type": "text", "text": REPLY}]), _delta("stop"), DONE),
        events(_delta(reasoning_content=DRAFT), _delta(content=None), _delta("stop", content=REPLY), DONE),
    ],
)
def test_the_words_of_a_message_are_its_text_whatever_its_shape(server, bench, answer):
    server.script(answer)
    assert bench.plan().policy == HELD


def test_reasoning_alone_is_no_answer(server, bench):
    server.script(body(_message(content=None, reasoning_content=DRAFT), "application/json"))
    plan = bench.plan()
    assert plan.policy is None and plan.intent == "unusable"


@pytest.mark.parametrize(
    "answer",
    [
        events(_delta(refusal="I can't "), _delta(refusal="do that."), _delta("stop"), DONE),
        events(_delta(content="Thoughts"), _delta(refusal="I can't do that."), DONE),
        body(_message(content="", refusal="I can't do that."), "application/json"),
    ],
)
def test_a_refusal_field_is_the_model_s_word(server, bench, answer):
    server.script(answer)
    plan = bench.plan()
    assert (plan.policy, plan.refusal, plan.intent) == (None, "I can't do that.", "declined")


def test_a_program_that_a_filter_cut_is_not_driven(server, bench):
    server.script(events(chunk(REPLY), chunk(finish="content_filter"), DONE))
    plan = bench.plan()
    assert plan.policy is None and "content_filter" in plan.refusal


def test_a_refusal_reaches_the_readers_of_prose_as_one(server, bench):
    server.script(body(_message(content=None, refusal="I can't do that."), "application/json"))

    async def ask() -> None:
        chat: ChatModel = bench.planner()._chat
        prose = await chat.write([{"role": "user", "content": "Which one?"}])
        await chat.close()
        assert prose.declined and prose.text == "I can't do that."

    asyncio.run(ask())


# Refusals -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("status", "content", "said"),
    [
        (400, [{"error": {"code": 400, "message": "The moon is full."}}], "The moon is full"),
        (
            422,
            {"detail": [{"loc": ["body", "top_k"], "msg": "Field required", "type": "missing"}]},
            "body.top_k: Field required",
        ),
        (422, {"detail": "The moon is full."}, "The moon is full"),
        (400, {"detail": {"message": "The moon is full."}}, "The moon is full"),
        (400, {"error": "The moon is full."}, "The moon is full"),
        (400, {"error": {"message": {"detail": "The moon is full."}}}, "The moon is full"),
        (400, {"errors": ["The moon is full.", "So is the sun."]}, "The moon is full.; So is the sun"),
        (400, {"title": "Bad", "detail": "The moon is full."}, "The moon is full"),
        (400, {"msg": "The moon is full."}, "The moon is full"),
        (400, "The moon is full.", "The moon is full"),
        (200, {"error": {"message": "The moon is full.", "code": 400}}, "The moon is full"),
        (200, {"error": "The moon is full."}, "The moon is full"),
        (200, {"object": "error", "message": "The moon is full.", "code": 400}, "The moon is full"),
        (200, [{"error": {"message": "The moon is full."}}], "The moon is full"),
        (200, {"detail": "The moon is full."}, "The moon is full"),
        (200, {"choices": [{"error": {"message": "The moon is full."}, "finish_reason": "error"}]}, "The moon is full"),
    ],
)
def test_the_server_s_own_words_are_shown(server, bench, status, content, said):
    data = json.dumps(content).encode()

    def answer(exchange: Exchange) -> None:
        exchange.head(status, "application/json", Content_Length=str(len(data)))
        exchange.write(data)

    server.script(answer)
    assert said in failure(bench).message


@pytest.mark.parametrize(
    "value",
    [
        {"error": {"message": "The moon is full."}},
        {"object": "error", "message": "The moon is full."},
        {"detail": "The moon is full."},
    ],
)
def test_an_error_in_a_stream_is_told_in_its_words(server, bench, value):
    server.script(events(b"data: " + json.dumps(value).encode() + b"\n\n", DONE))
    assert "The moon is full" in failure(bench).message


def test_the_status_that_an_error_inside_a_reply_names_counts(server, bench):
    server.script(body(b'{"error": {"message": "slow down", "code": 429}}', "application/json"), stream(REPLY))
    assert bench.plan().policy == HELD and len(server.requests) == 2
    server.script(body(b'{"error": {"message": "no such key", "code": 401}}', "application/json"))
    assert failure(bench).kind == "unauthorized"


def test_plain_words_are_shown_and_pages_are_not(server, bench):
    server.script(raw(b"HTTP/1.1 400 Bad Request\r\nContent-Type: text/plain\r\n\r\nno such luck"))
    assert "no such luck" in failure(bench).message
    server.script(raw(b"HTTP/1.1 400 Bad Request\r\nContent-Type: text/html\r\n\r\n<html><p>no such luck"))
    assert "no such luck" not in failure(bench).message


@pytest.mark.parametrize("status", [400, 422, 500])
@pytest.mark.parametrize(
    "said",
    [
        "System role not supported",
        "Developer instruction is not enabled for models/gemma-3-27b-it",
        "Conversation roles must alternate user/assistant/user/assistant/...",
        "Unexpected role 'system' in message 0",
        "Only user and assistant roles are supported!",
        "messages[0].role: must be one of user, assistant; system is invalid",
        "jinja template rendering failed. TemplateError: System message not supported by this model",
    ],
)
def test_a_template_without_a_system_turn_is_asked_without_one(server, bench, status, said, caplog):
    server.script(fails(status, said), stream(REPLY))
    assert bench.plan().policy == HELD
    assert [turn["role"] for turn in server.requests[1].body["messages"]] == ["user"]
    assert "takes no system turn" in caplog.text


def test_a_template_that_likes_nothing_is_asked_twice(server, bench):
    server.script(fails(400, "System role not supported"))
    assert "System role not supported" in failure(bench).message
    assert len(server.requests) == 2


# Packed bodies --------------------------------------------------------------------------------------------------------


@cache
def _bomb(packing: str) -> bytes:
    """Some kilobytes that unpack to 400 MB, six times the bound of a reply."""
    piece = b" " * 1_000_000
    if packing == "zstd":
        return zstandard.ZstdCompressor(level=19).compress(piece * 400)
    packer = zlib.compressobj(9, zlib.DEFLATED, 31 if packing == "gzip" else 15)
    return b"".join([*(packer.compress(piece) for _ in range(400)), packer.flush()])


@pytest.mark.parametrize("packing", ["gzip", "deflate", "zstd"])
@pytest.mark.parametrize("status", ["200 OK", "400 Bad Request"])
def test_a_packed_flood_is_bounded_before_it_is_unpacked(server, bench, packing, status):
    bomb = _bomb(packing)
    assert len(bomb) < 2_000_000
    head = f"HTTP/1.1 {status}\r\nContent-Type: application/json\r\nContent-Encoding: {packing}\r\n\r\n"
    server.script(raw(head.encode() + bomb))
    import resource

    before, started = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
    assert failure(bench).kind in ("garbage", "bad_request")
    assert time.process_time() - started < 5.0
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown < 300_000, "kilobytes; 64 MB of reply is the bound"


@pytest.mark.parametrize("packing", ["gzip", "x-gzip", "deflate", "identity"])
def test_an_honest_packed_answer_is_read_though_none_was_asked_for(server, bench, packing):
    plain = io.BytesIO(b"".join(ENDED)).getvalue()
    data = {"deflate": zlib.compress(plain), "identity": plain}.get(packing) or gzip.compress(plain)
    server.script(typed("text/event-stream", data, Content_Encoding=packing))
    assert bench.plan().policy == HELD
    assert server.requests[0].headers["accept-encoding"] == "identity"


def test_a_packed_answer_that_drips_is_bounded_in_time(server, bench):
    data = gzip.compress(b"".join(ENDED) * 50)

    def answer(exchange: Exchange) -> None:
        exchange.head(200, "text/event-stream", Content_Encoding="gzip")
        for i in range(len(data)):
            exchange.write(data[i : i + 1])
            exchange.pause(0.05)

    server.script(answer)
    assert failure(bench, timeout_s=0.3).kind == "timeout"


# Keys -----------------------------------------------------------------------------------------------------------------


def test_a_short_key_masks_no_letters_of_a_reply_and_no_words_of_an_error(server, bench):
    bench.environ = {"CHAUFFEUR_API_KEY": "x"}
    reply = REPLY.replace("Hold", "Relax, next exit: hold x")
    server.script(stream(reply))
    assert bench.plan().raw == reply
    server.script(fails(400, "max exceeded; your key is x."))
    assert "max exceeded; your key is ***" in failure(bench).message


def test_a_model_that_repeats_its_refused_answer_is_not_asked_for_ever(server, bench):
    server.script(whole("Just prose."))
    plan = bench.plan(repairs=4)
    assert plan.intent == "unusable" and len(server.requests) == 2


def test_a_repair_turn_repeated_as_an_answer_is_told_as_such(server, bench):
    said: list[str] = []

    def echo(exchange: Exchange) -> None:
        asked = server.requests[-1].body["messages"]
        said.append(asked[-1]["content"])
        whole("Hm." if len(asked) == 2 else said[-1])(exchange)

    server.script(echo)
    plan = bench.plan(repairs=1)
    assert plan.policy is None and "repeats what the checks said" in plan.refusal
