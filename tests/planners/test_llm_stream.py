"""How replies come over the wire: events cut anywhere, connections that serve again, redirects, refusals."""

from __future__ import annotations

import asyncio
import json

import pytest
from server import DONE, PROGRAM, REPLY, Exchange, ModelServer, body, chunk, events, stream

from chauffeur.concept import Program
from chauffeur.planners.llm_errors import EndpointError

pytestmark = pytest.mark.server

WIRE = (
    b": hello\r\nevent: message\r\nid: 7\r\n"
    + chunk(REPLY[:40]).replace(b"\n", b"\r")
    + b"data\n\n: more\n"
    + chunk(REPLY[40:], finish="stop").replace(b"data: ", b"data:").replace(b'"created"', b'\ndata: "created"')
    + DONE
    + b"data: torn"
)


@pytest.mark.parametrize("size", [1, 2, 3, 5, 1000])
def test_events_are_the_same_however_they_are_cut(server: ModelServer, bench, size: int) -> None:
    server.script(events(*(WIRE[i : i + size] for i in range(0, len(WIRE), size))))
    assert bench.plan().policy == Program(PROGRAM)


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_every_line_end_of_the_standard_is_read(server: ModelServer, bench, end: str) -> None:
    pieces = [piece.replace(b"\n", end.encode()) for piece in (chunk(REPLY), chunk(finish="stop"), DONE)]
    server.script(events(*pieces))
    assert bench.plan().policy == Program(PROGRAM)


def test_words_with_line_separators_are_one_line(server: ModelServer, bench) -> None:
    value = json.loads(chunk(f"Fine.\u2028\x85{REPLY}").removeprefix(b"data: "))
    raw = b"data: " + json.dumps(value, ensure_ascii=False).encode() + b"\n\n"
    server.script(events(raw, chunk(finish="stop"), DONE))
    assert bench.plan().policy == Program(PROGRAM)


@pytest.mark.parametrize("behind", [b"", b": that was all\n\n"])
def test_a_connection_whose_stream_was_read_to_its_end_serves_again(
    server: ModelServer, bench, make_request, behind: bytes
) -> None:
    ports: list[int] = []

    def kept_alive(exchange: Exchange) -> None:
        ports.append(exchange.client_address[1])
        exchange.head(200, "text/event-stream", close=False, Transfer_Encoding="chunked")
        for piece in (chunk(REPLY), chunk(finish="stop"), DONE, behind):
            if piece:
                exchange.write(f"{len(piece):x}\r\n".encode() + piece + b"\r\n")
        exchange.write(b"0\r\n\r\n")

    server.script(kept_alive)

    async def twice() -> None:
        planner = bench.planner()
        for words in ("a", "b"):
            assert (await planner.plan(make_request(words))).policy == Program(PROGRAM)
        await planner.close()

    asyncio.run(twice())
    assert len(ports) == 2 and len(set(ports)) == 1


def test_a_stream_that_stays_open_behind_its_end_keeps_nobody_waiting(server: ModelServer, bench) -> None:
    def open_ended(exchange: Exchange) -> None:
        events(chunk(REPLY), chunk(finish="stop"), DONE)(exchange)
        exchange.pause(30.0)

    server.script(open_ended)
    assert bench.plan(timeout_s=5.0).policy == Program(PROGRAM), "else: a time-out"


@pytest.mark.parametrize(
    "flood", [events(b"data: " + b"x" * 5_000), body(b"{" + b" " * 5_000, "application/json")], ids=["events", "whole"]
)
def test_a_flood_is_not_read_to_its_end(server: ModelServer, bench, monkeypatch, flood) -> None:
    monkeypatch.setattr("chauffeur.planners.llm_endpoint._MAX_BODY_BYTES", 1_000)
    server.script(flood)
    with pytest.raises(EndpointError, match="more than"):
        bench.plan()


def test_the_key_does_not_follow_a_redirect_to_somebody_else(server: ModelServer, bench, secret: str) -> None:
    other = ModelServer()
    try:

        def elsewhere(exchange: Exchange) -> None:
            exchange.head(307, "text/plain", Location=f"{other.url}/chat/completions", Content_Length="0")

        server.script(elsewhere)
        assert bench.plan().policy == Program(PROGRAM)
        assert server.requests[0].headers["authorization"] == f"Bearer {secret}"
        assert "authorization" not in other.requests[0].headers
    finally:
        other.close()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b'{"message": "no such model"}', ": no such model."),
        (b'{"error": {"message": 5}}', "(404)."),
        (b"<html>not here</html>", "(404)."),
        (b"[" * 50_000, "(404)."),
    ],
)
def test_a_refusal_is_told_in_the_server_s_words_where_it_has_any(
    server: ModelServer, bench, content: bytes, said: str
) -> None:
    def refuses(exchange: Exchange) -> None:
        exchange.head(404, "application/json", Content_Length=str(len(content)))
        exchange.write(content)

    server.script(refuses)
    with pytest.raises(EndpointError) as caught:
        bench.plan()
    assert caught.value.kind == "not_found" and caught.value.message.endswith(said)


def test_words_that_no_encoding_takes_are_sent_all_the_same(server: ModelServer, bench) -> None:
    server.script(stream(REPLY))
    assert bench.plan("hold 25 m/s \ud800 é").policy == Program(PROGRAM)
    assert "25 m/s" in server.requests[0].body["messages"][1]["content"]
