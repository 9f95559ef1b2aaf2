"""A real chat-completions server on loopback that answers by script, faults included."""

from __future__ import annotations

import json
import socket
import struct
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

Answer = Callable[["Exchange"], None]
"""Answers one request."""

PROGRAM = """def hold():
    while True:
        set_target_speed(25.0)
        yield autopilot()
"""

REPLY = f"Thoughts: Hold 25 m/s.\n\n```python\n{PROGRAM}```\n"


@dataclass
class Request:
    """What a client sent."""

    path: str
    headers: dict[str, str]
    body: dict[str, Any]


class Exchange(BaseHTTPRequestHandler):
    """One request, with the ways to answer it."""

    protocol_version = "HTTP/1.1"
    server: _Server

    def do_POST(self) -> None:
        length = int(self.headers.get("content-length", "0"))
        body = json.loads(self.rfile.read(length) or b"{}")
        headers = {name.lower(): value for name, value in self.headers.items()}
        self.server.model.take(Request(self.path, headers, body))(self)

    def log_message(self, format: str, *args: object) -> None:
        pass

    def head(self, status: int, content_type: str, *, close: bool = True, **headers: str) -> None:
        self.send_response(status)
        self.send_header("Content-Type", content_type)
        for name, value in headers.items():
            self.send_header(name.replace("_", "-"), value)
        if close:
            self.send_header("Connection", "close")
        self.end_headers()
        self.close_connection = close

    def write(self, data: bytes) -> None:
        try:
            self.wfile.write(data)
            self.wfile.flush()
        except OSError:
            self.close_connection = True

    def pause(self, seconds: float) -> None:
        self.server.model.closing.wait(seconds)

    def reset(self) -> None:
        """Break the connection off with a TCP reset."""
        self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.connection.close()
        self.close_connection = True


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    request_queue_size = 128
    model: ModelServer

    def handle_error(self, request: object, client_address: object) -> None:
        pass


@dataclass
class ModelServer:
    """Answers by script; the last answer repeats."""

    requests: list[Request] = field(default_factory=list)
    closing: threading.Event = field(default_factory=threading.Event)

    def __post_init__(self) -> None:
        self._script: list[Answer] = [stream(REPLY)]
        self._lock = threading.Lock()
        self._http = _Server(("127.0.0.1", 0), Exchange)
        self._http.model = self
        self._thread = threading.Thread(target=self._http.serve_forever, args=(0.01,), daemon=True)
        self._thread.start()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self._http.server_address[1]}/v1"

    def script(self, *answers: Answer) -> None:
        self._script = list(answers)

    def take(self, request: Request) -> Answer:
        with self._lock:
            self.requests.append(request)
            return self._script.pop(0) if len(self._script) > 1 else self._script[0]

    def close(self) -> None:
        self.closing.set()
        self._http.shutdown()
        self._http.server_close()
        self._thread.join()


def chunk(
    text: str | None = None, *, finish: str | None = None, usage: tuple[int, int] | None = None, model: str = "served-1"
) -> bytes:
    """A piece of a stream, as one server-sent event."""
    choices: list[dict[str, Any]] = []
    if text is not None or finish is not None:
        delta = {} if text is None else {"content": text}
        choices = [{"index": 0, "delta": delta, "finish_reason": finish}]
    value: dict[str, Any] = {
        "id": "c1", "object": "chat.completion.chunk", "created": 1, "model": model, "choices": choices,
    }  # fmt: skip
    if usage is not None:
        value["usage"] = {
            "prompt_tokens": usage[0], "completion_tokens": usage[1], "total_tokens": sum(usage),
        }  # fmt: skip
    return b"data: " + json.dumps(value).encode() + b"\n\n"


DONE = b"data: [DONE]\n\n"


def events(*pieces: bytes, pause_s: float = 0.0) -> Answer:
    """A stream of given pieces."""

    def answer(exchange: Exchange) -> None:
        exchange.head(200, "text/event-stream; charset=utf-8")
        for piece in pieces:
            exchange.write(piece)
            if pause_s:
                exchange.pause(pause_s)

    return answer


def stream(text: str, *, finish: str = "stop", size: int = 7, usage: tuple[int, int] = (1000, 200)) -> Answer:
    """A proper streamed reply."""
    parts = [text[i : i + size] for i in range(0, len(text), size)]
    return events(chunk(""), *(chunk(part) for part in parts), chunk(finish=finish), chunk(usage=usage), DONE)


def whole(text: str | None, *, finish: str = "stop", usage: tuple[int, int] = (1000, 200)) -> Answer:
    """A proper reply in one piece."""
    value = {
        "id": "c1", "object": "chat.completion", "created": 1, "model": "served-1",
        "choices": [{"index": 0, "message": {"role": "assistant", "content": text}, "finish_reason": finish}],
        "usage": {"prompt_tokens": usage[0], "completion_tokens": usage[1], "total_tokens": sum(usage)},
    }  # fmt: skip
    return body(json.dumps(value).encode(), "application/json")


def body(data: bytes, content_type: str) -> Answer:
    """A successful answer with any body."""

    def answer(exchange: Exchange) -> None:
        exchange.head(200, content_type, close=False, Content_Length=str(len(data)))
        exchange.write(data)

    return answer


def fails(
    status: int, message: str = "no", code: str | None = None, param: str | None = None, **headers: str
) -> Answer:
    """An error in OpenAI's form."""
    data = json.dumps({"error": {"message": message, "type": "error", "param": param, "code": code}}).encode()

    def answer(exchange: Exchange) -> None:
        exchange.head(status, "application/json", Content_Length=str(len(data)), **headers)
        exchange.write(data)

    return answer


def silent(seconds: float) -> Answer:
    """No first byte for a while."""

    def answer(exchange: Exchange) -> None:
        exchange.pause(seconds)
        exchange.close_connection = True

    return answer


def reset_after(*pieces: bytes) -> Answer:
    """A stream whose connection is reset."""

    def answer(exchange: Exchange) -> None:
        exchange.head(200, "text/event-stream", Transfer_Encoding="chunked")
        for piece in pieces:
            exchange.write(f"{len(piece):x}\r\n".encode() + piece + b"\r\n")
        exchange.pause(0.05)
        exchange.reset()

    return answer
