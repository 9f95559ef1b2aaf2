"""The planner against a real server that does not behave, and against none."""

from __future__ import annotations

import asyncio
import logging
import socket
import time

import pytest
from server import DONE, PROGRAM, REPLY, body, chunk, events, fails, reset_after, silent, stream, whole

from chauffeur.concept import ConfigError, Program
from chauffeur.planners.cache import ReplyCache
from chauffeur.planners.llm_endpoint import Sampling
from chauffeur.planners.llm_errors import EndpointError, retry_after_s
from chauffeur.planners.llm_retry import RetryPolicy
from chauffeur.planners.llm_settings import parse_address

pytestmark = pytest.mark.server


def failure(bench, **options) -> EndpointError:
    with pytest.raises(EndpointError) as caught:
        bench.plan(**options)
    return caught.value


def test_401_names_the_variable_and_is_not_tried_again(server, bench, secret):
    server.script(fails(401, f"Incorrect API key provided: {secret}", code="invalid_api_key"))
    error = failure(bench)
    assert (error.kind, error.retryable) == ("unauthorized", False)
    assert "CHAUFFEUR_API_KEY" in str(error)
    assert len(server.requests) == 1
    bench.environ = {"OPENAI_API_KEY": secret}
    assert "OPENAI_API_KEY" in failure(bench).hint
    bench.environ = {}
    assert "wants a key" in failure(bench).hint


@pytest.mark.parametrize(
    ("status", "code", "kind", "hint"),
    [
        (400, None, "bad_request", ""),
        (403, None, "forbidden", "access"),
        (404, "model_not_found", "not_found", "/models"),
        (429, "insufficient_quota", "quota", "billing"),
        (501, None, "bad_request", ""),
    ],
)
def test_a_final_refusal_is_told_in_the_servers_words_and_not_tried_again(server, bench, status, code, kind, hint):
    server.script(fails(status, "the moon is full", code=code))
    error = failure(bench)
    assert (error.kind, error.retryable, len(server.requests), bench.waits) == (kind, False, 1, [])
    assert "the moon is full" in error.message and hint in error.hint


@pytest.mark.parametrize(
    ("answers", "waits"),
    [
        ((fails(429, Retry_After="7"),), [(7.0, 7.5)]),
        ((fails(500), fails(503)), [(0.25, 0.5), (0.5, 1.0)]),
        ((events(chunk(REPLY[:40]), chunk(REPLY[40:80])),), [(0.25, 0.5)]),
        ((reset_after(chunk(REPLY[:40])),), [(0.25, 0.5)]),
    ],
)
def test_what_may_pass_is_tried_again_after_a_wait(server, bench, answers, waits):
    server.script(*answers, stream(REPLY))
    plan = bench.plan()
    assert plan.policy == Program(PROGRAM)
    assert plan.usage.requests == 1 + len(answers)
    assert len(bench.waits) == len(waits)
    assert all(low <= wait <= high for wait, (low, high) in zip(bench.waits, waits, strict=True))


@pytest.mark.parametrize(
    ("answer", "kind", "words"),
    [
        (fails(500, "the GPU fell off"), "server", "the GPU fell off"),
        (events(chunk(REPLY[:40]), chunk(REPLY[40:80])), "truncated", "broke off"),
        (reset_after(chunk(REPLY[:40])), "broken", ""),
    ],
)
def test_what_does_not_pass_ends_after_the_same_waits(server, bench, answer, kind, words):
    server.script(answer)
    error = failure(bench)
    first, bench.waits = bench.waits, []
    assert (error.kind, error.retryable, len(server.requests)) == (kind, True, 4)
    assert words in error.message and "Tried 4 times." in error.message
    failure(bench)
    assert bench.waits == first and len(set(first)) == 3


def test_a_wait_beyond_our_patience_fails_at_once_and_says_so(server, bench):
    server.script(fails(429, Retry_After="3600"))
    error = failure(bench)
    assert (error.kind, error.retryable, error.retry_after_s) == ("rate_limit", True, 3600.0)
    assert "3600 s" in error.message
    assert bench.waits == []


_DRIPPING = events(*(chunk("x") for _ in range(1000)), pause_s=0.02)


@pytest.mark.parametrize("answer", [silent(5.0), _DRIPPING])
@pytest.mark.parametrize(
    ("temperature", "limits", "words", "requests"),
    [
        (0.0, {"timeout_s": 0.15, "retry": RetryPolicy(attempts=2)}, "Not asked again", 1),
        (0.7, {"timeout_s": 0.15, "retry": RetryPolicy(attempts=2)}, "Tried 2 times", 2),
        (0.7, {"timeout_s": 0.1, "budget_s": 0.25}, "within 0.25 s", None),  # as many as there is time for
    ],
)
def test_a_reply_that_does_not_end_is_bounded_and_asked_again_where_it_may_come_out_otherwise(
    server, bench, answer, temperature, limits, words, requests
):
    server.script(answer)
    started = time.monotonic()
    error = failure(bench, sampling=Sampling(temperature=temperature), **limits)
    assert error.kind == "timeout" and words in error.message
    assert "CHAUFFEUR_TIMEOUT_S" in error.hint
    assert requests is None or len(server.requests) == requests
    assert time.monotonic() - started < 2.0


@pytest.mark.parametrize(
    "pieces",
    [
        (b'data: {"choices": [{]}\n\n',),
        (b"data: \xff\xfe\xfa\n\n",),
        (b"data: [1, 2, 3]\n\n", DONE),
        (b'data: "hello"\n\n', DONE),
        (b"data: null\n\n", DONE),
        (b'data: {"choices": 5}\n\n', DONE),
        (b"\x00\x01\x02\n\n",),
        (DONE,),
        (b"data: " + b"[" * 50_000 + b"\n\n",),
    ],
)
def test_garbage_in_the_stream_is_a_typed_failure(server, bench, pieces):
    server.script(events(*pieces))
    error = failure(bench)
    assert error.kind in {"garbage", "truncated"} and error.retryable
    asked = [request for request in server.requests if request.body.get("stream")]
    assert len(server.requests) == 4 + (len(asked) < 4), "an empty stream is asked for whole, once"


@pytest.mark.parametrize(
    "choice",
    [
        b"5",
        b"null",
        b"{}",
        b'{"delta": 7}',
        b'{"delta": {"content": 9}, "finish_reason": 3}',
        b'{"delta": {"content": [5, {"type": "text", "text": 5}]}}',
    ],
)
def test_fields_of_the_wrong_type_are_no_crash(server, bench, choice):
    server.script(events(b'data: {"choices": [' + choice + b'], "usage": {"prompt_tokens": "many"}}\n\n', DONE))
    assert failure(bench).kind == "truncated"


def test_an_error_inside_the_stream_is_a_failure(server, bench, secret):
    server.script(
        events(chunk("Thoughts"), b'data: {"error": {"message": "out of memory ' + secret.encode() + b'"}}\n\n'),
        stream(REPLY),
    )
    assert bench.plan().policy is not None
    assert len(server.requests) == 2


@pytest.mark.parametrize("streamed", [True, False])
def test_a_web_page_is_not_an_api(server, bench, streamed):
    server.script(body(b"<html><body>Welcome to nginx!</body></html>", "text/html"))
    error = failure(bench, stream=streamed)
    assert (error.kind, error.retryable) == ("not_an_api", False)
    assert "/v1" in error.hint


@pytest.mark.parametrize("data", [b"{", b"\xff\xff", b"[]", b"{}", b'{"choices": null}', b"null", b""])
def test_garbage_instead_of_a_whole_reply(server, bench, data):
    server.script(body(data, "application/json"))
    error = failure(bench, stream=False)
    assert error.kind == "garbage" and error.retryable


def test_a_whole_reply_without_words_is_asked_for_again(server, bench):
    server.script(whole(None), whole(REPLY))
    assert bench.plan(stream=False).policy == Program(PROGRAM)


@pytest.mark.parametrize("streamed", [True, False])
def test_ten_megabytes_are_cut_and_cost_no_time(server, bench, streamed):
    flood = "blah " * 2_000_000
    server.script(stream(flood, size=100_000) if streamed else whole(flood))
    started = time.monotonic()
    plan = bench.plan(stream=streamed)
    assert plan.policy is None and "cut off" in plan.refusal
    assert len(plan.raw) == 200_000
    assert time.monotonic() - started < 5.0


def test_invisible_and_broken_characters_survive(server, bench):
    server.script(stream("Thoughts: \u202e caf\u00e9 \U0001f697 " + REPLY))
    assert bench.plan().policy == Program(PROGRAM)
    lone = REPLY.replace("Hold", "\ud800Hold")
    server.script(events(chunk(lone), chunk(finish="stop"), DONE))
    plan = bench.plan()
    assert plan.policy == Program(PROGRAM)
    plan.raw.encode("utf-8")


def test_nobody_listens(bench):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{free.getsockname()[1]}/v1"
    error = failure(bench, url=url)
    assert (error.kind, error.retryable) == ("unreachable", True)
    assert url in error.message and len(bench.waits) == 3


def test_a_name_that_does_not_resolve(bench):
    error = failure(bench, url="http://no-such-host.invalid.localhost.test.local/v1", retry=RetryPolicy(attempts=1))
    assert (error.kind, error.retryable) == ("dns", True)


def test_a_public_endpoint_without_a_key_is_not_even_asked(bench):
    bench.environ = {}
    error = failure(bench, url="https://api.example.com/v1")
    assert (error.kind, error.retryable) == ("no_key", False)
    assert "CHAUFFEUR_API_KEY" in error.hint and "OPENAI_API_KEY" in error.hint


def test_a_key_never_crosses_a_public_network_unencrypted(bench, secret):
    with pytest.raises(ConfigError, match="unencrypted") as caught:
        bench.plan(url="http://api.example.com/v1")
    assert secret not in str(caught.value)


@pytest.mark.parametrize("key", ["sk-a\nb", "sk-ä", "sk a", "sk-\x7f"])
def test_a_key_that_cannot_be_one_is_refused_without_showing_it(bench, key):
    bench.environ = {"CHAUFFEUR_API_KEY": key}
    with pytest.raises(ConfigError, match="CHAUFFEUR_API_KEY") as caught:
        bench.plan()
    assert key not in str(caught.value)


def test_a_trailing_line_break_of_a_key_does_no_harm(server, bench, secret):
    bench.environ = {"CHAUFFEUR_API_KEY": f" {secret}\n"}
    bench.plan()
    assert server.requests[0].headers["authorization"] == f"Bearer {secret}"


@pytest.mark.parametrize(
    "url", ["ftp://x/v1", "x", "http://", "http://[", "http://u:p@h/v1", "https://h/v1?key=s", "https://h:99999/v1"]
)
def test_addresses_that_are_none_are_refused_without_their_secrets(url):
    with pytest.raises(ConfigError) as caught:
        parse_address(url, {})
    assert ":p@" not in str(caught.value) and "key=s" not in str(caught.value)


def test_the_address_comes_from_argument_then_environment():
    environ = {"OPENAI_BASE_URL": "https://b.example/v1/"}
    assert parse_address("http://A.local:80/v1/", environ).url == "http://a.local:80/v1"
    assert parse_address(None, environ).url == "https://b.example/v1"
    assert parse_address(None, environ | {"CHAUFFEUR_BASE_URL": "http://[::1]:5/v1"}).url == "http://[::1]:5/v1"
    assert parse_address(None, {}).host == "api.openai.com"


def test_the_key_is_in_no_log_no_error_no_file_and_no_plan(server, bench, secret, caplog, tmp_path, monkeypatch):
    monkeypatch.setenv("OPENAI_LOG", "debug")
    caplog.set_level(logging.DEBUG)
    echo = f"Your header was: Bearer {secret}. "
    recorded = []
    for status in (400, 401, 403, 404, 429, 500):
        server.script(fails(status, echo, Retry_After="1"))
        recorded.append(failure(bench))
    server.script(events(b'data: {"error": {"message": "' + echo.encode() + b'"}}\n\n'))
    recorded.append(failure(bench))
    server.script(stream(REPLY))
    plan = bench.plan(cache=ReplyCache(tmp_path))
    assert plan.policy is not None
    for error in recorded:
        seen = error
        assert seen.__cause__ is None and seen.__context__ is None
        assert secret not in f"{seen} {seen!r} {seen.args} {vars(seen)}"
    assert secret not in repr(plan)
    assert len(caplog.records) > 10
    for record in caplog.records:
        assert secret not in f"{record.getMessage()} {record.__dict__}"
    files = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert files
    assert all(secret.encode() not in path.read_bytes() for path in files)
    assert secret not in repr(bench.planner())


def test_retry_after_in_every_form():
    date = "Wed, 21 Oct 2026 07:28:00 GMT"
    assert retry_after_s({"retry-after": "2"}) == 2.0
    assert retry_after_s({"retry-after-ms": "1500", "retry-after": "2"}) == 1.5
    assert retry_after_s({"retry-after": "Wed, 21 Oct 2026 07:28:09 GMT", "date": date}) == 9.0
    assert retry_after_s({"retry-after": "Wed, 21 Oct 2026 07:27:00 GMT", "date": date}) == 0.0
    for nonsense in ("soon", "-1", "nan", "inf", ""):
        assert retry_after_s({"retry-after": nonsense}) is None
    assert retry_after_s({"retry-after": date}) is None


def test_giving_up_in_the_middle_leaves_nothing_behind(server, bench, make_request):
    server.script(events(*(chunk("x") for _ in range(1000)), pause_s=0.02))

    async def run():
        planner = bench.planner()
        task = asyncio.create_task(planner.plan(make_request("x")))
        await asyncio.sleep(0.1)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        await planner.close()

    asyncio.run(run())
