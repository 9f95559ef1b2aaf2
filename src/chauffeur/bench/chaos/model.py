"""A real server in the OpenAI protocol, on loopback, that answers as a case tells it to: well, badly, late or not at
all."""

from __future__ import annotations

import json
import socket
import struct
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import TracebackType
from typing import Any, Final, Self, cast

from chauffeur.bench.chaos import replies

LONGEST_BYTES: Final = 64 << 20
"""Of a reply that does not end; a client that does not stop reading earlier has lost."""
_TRICKLE_S: Final = 0.05
_BLOCK: Final = 64 << 10


@dataclass(slots=True)
class Script:
    """How the server answers.

    Attributes:
        good: Answer by words that stand in the wish.
        fault: Name in `FAULTS`; empty for none.
        times: Requests that the fault befalls; afterwards all is well.
        late_s: For the fault `late`.
        asked: Requests so far.
        hit: Requests that the fault befell.
    """

    good: dict[str, str] = field(default_factory=dict[str, str])
    fault: str = ""
    times: int = 0
    late_s: float = 0.0
    asked: int = 0
    hit: int = 0


class ModelServer:
    """The server; answers from threads of its own."""

    def __init__(self) -> None:
        self.script = Script()
        self.closing = threading.Event()
        self._lock = threading.Lock()
        self._http = _Server(("127.0.0.1", 0), _Exchange)
        self._http.model = self
        self._thread = threading.Thread(target=self._http.serve_forever, args=(0.05,), daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def url(self) -> str:
        """Base address."""
        return f"http://127.0.0.1:{self._http.server_address[1]}/v1"

    def close(self) -> None:
        """Stop answering."""
        self.closing.set()
        self._http.shutdown()
        self._http.server_close()
        self._thread.join()

    def take(self, words: str) -> tuple[str, str, float]:
        """Fault, good answer and delay for a request with these words."""
        with self._lock:
            script = self.script
            script.asked += 1
            fault = ""
            if script.fault and script.hit < script.times:
                script.hit += 1
                fault = script.fault
            # The newest wish stands last in a conversation.
            wish = max(script.good, key=words.rfind, default="")
            return fault, script.good.get(wish, replies.REFUSES), script.late_s


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    request_queue_size = 64
    model: ModelServer

    def handle_error(self, request: object, client_address: object) -> None:
        """A client that went away is nothing to tell of."""


class _Exchange(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    @property
    def model(self) -> ModelServer:
        """Who is asked."""
        return cast("_Server", self.server).model

    def do_POST(self) -> None:
        """Answer a request."""
        length = int(self.headers.get("content-length", "0"))
        asked = json.loads(self.rfile.read(length) or b"{}")
        words = "\n".join(str(message.get("content", "")) for message in asked.get("messages", []))
        fault, good, late_s = self.model.take(words)
        self.close_connection = True
        try:
            if fault == "late":
                self.pause(late_s)
                fault = ""
            FAULTS[fault](self, good)
        except OSError:
            pass

    def log_message(self, format: str, *args: object) -> None:
        """Nothing."""

    def begin(self, status: int = 200, content_type: str = "text/event-stream", **headers: str) -> None:
        """Status and headers."""
        self.send_response(status)
        self.send_header("Content-Type", content_type)
        self.send_header("Connection", "close")
        for name, value in headers.items():
            self.send_header(name.replace("_", "-"), value)
        self.end_headers()

    def put(self, data: bytes) -> None:
        """Some of the body."""
        self.wfile.write(data)
        self.wfile.flush()

    def pause(self, seconds: float) -> None:
        """Wait, but not beyond the server's end."""
        self.model.closing.wait(seconds)

    def cut(self) -> None:
        """Break the connection off."""
        self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.connection.close()


def _event(value: dict[str, Any]) -> bytes:
    return b"data: " + json.dumps(value).encode() + b"\n\n"


def _chunk(text: str | None, finish: str | None = None) -> bytes:
    delta = {} if text is None else {"content": text}
    choice = {"index": 0, "delta": delta, "finish_reason": finish}
    return _event(
        {"id": "c1", "object": "chat.completion.chunk", "created": 1, "model": "chaos", "choices": [choice]}
    )  # fmt: skip


def _stream(exchange: _Exchange, pieces: Iterable[str], pause_s: float = 0.0) -> None:
    exchange.begin()
    for piece in pieces:
        exchange.put(_chunk(piece))
        if pause_s:
            exchange.pause(pause_s)
            if exchange.model.closing.is_set():
                return
    exchange.put(_chunk(None, "stop") + b"data: [DONE]\n\n")


def _silent(exchange: _Exchange, good: str) -> None:
    del good
    exchange.pause(120.0)


def _trickle(exchange: _Exchange, good: str) -> None:
    _stream(exchange, good, _TRICKLE_S)


def _cut(exchange: _Exchange, good: str) -> None:
    exchange.begin()
    exchange.put(_chunk(good[: len(good) // 2]))
    exchange.pause(0.02)
    exchange.cut()


def _bad_utf8(exchange: _Exchange, good: str) -> None:
    exchange.begin()
    exchange.put(_chunk(good[:20])[:-6] + b"\xff\xfe\xc3\x28" + b'"}}]}\n\n')
    exchange.put(b"data: \xf0\x28\x8c\x28\n\ndata: [DONE]\n\n")


def _bad_json(exchange: _Exchange, good: str) -> None:
    exchange.begin()
    exchange.put(b'data: {"id": "c1", "choices": [{"index": 0, "delta": {"content": ' + good[:9].encode() + b"\n\n")
    exchange.put(b"data: [[[[\n\ndata: [DONE]\n\n")


def _status(status: int) -> Callable[[_Exchange, str], None]:
    def answer(exchange: _Exchange, good: str) -> None:
        del good
        data = json.dumps({"error": {"message": "no", "type": "error", "param": None, "code": None}}).encode()
        exchange.begin(status, "application/json", Content_Length=str(len(data)))
        exchange.put(data)

    return answer


def _endless(exchange: _Exchange, good: str) -> None:
    exchange.begin()
    block = _chunk(good + "# and on and on\n" * (_BLOCK // 16))
    for _ in range(LONGEST_BYTES // len(block)):
        exchange.put(block)


def _says(text: str) -> Callable[[_Exchange, str], None]:
    def answer(exchange: _Exchange, good: str) -> None:
        del good
        _stream(exchange, [text] if text else [])

    return answer


def _good(exchange: _Exchange, good: str) -> None:
    _stream(exchange, (good[i : i + 40] for i in range(0, len(good), 40)))


FAULTS: Final[dict[str, Callable[[_Exchange, str], None]]] = {
    "": _good,
    "silent": _silent,
    "trickle": _trickle,
    "cut": _cut,
    "bad-utf8": _bad_utf8,
    "bad-json": _bad_json,
    "http-500": _status(500),
    "http-429": _status(429),
    "endless": _endless,
    "empty": _says(""),
    "chatter": _says(replies.REFUSES),
    "unknown-api": _says(replies.UNKNOWN_API),
    "imports": _says(replies.IMPORTS),
    "never-yields": _says(replies.NEVER_YIELDS),
    "spins-later": _says(replies.SPINS_LATER),
    "dies-later": _says(replies.DIES_LATER),
    "beyond-limits": _says(replies.BEYOND_LIMITS),
    "creeps-beyond": _says(replies.CREEPS_BEYOND),
    "grows": _says(replies.GROWS),
    "leaps": _says(replies.LEAPS),
    "says-on-and-on": _says(replies.SAYS_ON_AND_ON),
    "wishes-on-and-on": _says(replies.WISHES_ON_AND_ON),
    "long-thoughts": _says(replies.LONG_THOUGHTS),
}
"""How to answer, by name; `late` is the good answer after a while."""
