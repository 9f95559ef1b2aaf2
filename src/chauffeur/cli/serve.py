"""`chauffeur model serve`: the on-board planner as a chat-completions endpoint on this machine."""

from __future__ import annotations

import asyncio
import json
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from itertools import count
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from chauffeur.concept import ChauffeurError, ConfigError, Limits

if TYPE_CHECKING:
    from chauffeur.planners.base import Planner

EXAMPLES = """
Examples:

    chauffeur model serve --port 8040

    chauffeur drive "Overtake it." --planner openai/onboard --base-url http://127.0.0.1:8040/v1

Speaks OpenAI's chat-completions protocol, streaming included. It listens on this machine only unless --host says
otherwise; there is no password.
"""

MAX_BODY_BYTES: Final = 1_000_000
_PIECE_CHARS: Final = 24


def serve(
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0 takes a free one.")] = 8040,
    planner: Annotated[str, typer.Option(help="Planner to serve: `onboard`, or `onboard/FOLDER`.")] = "onboard",
    limits: Annotated[str, typer.Option(help="Bounds of its own choices: `default` or `lampilot`.")] = "default",
) -> None:
    """Serve the on-board planner on this machine, in OpenAI's chat-completions protocol."""
    from chauffeur.cli.console import stdout
    from chauffeur.cli.parts import limits_named
    from chauffeur.planners.registry import make_planner

    server = ServedEndpoint(host, port, make_planner(planner), limits_named(limits))
    address = f"http://{host}:{server.server_port}/v1"
    stdout().print(f"Serving {planner} at {address} (Ctrl-C ends it)", soft_wrap=True)
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        stdout().print("Stopped.")
    finally:
        server.server_close()


class ServedEndpoint(ThreadingHTTPServer):
    """A chat-completions endpoint over one planner, which answers one request at a time."""

    daemon_threads = True

    def __init__(self, host: str, port: int, planner: Planner, limits: Limits) -> None:
        """Listen.

        Raises:
            ConfigError: The address cannot be listened on.
        """
        try:
            super().__init__((host, port), _Exchange)
        except OSError as error:
            words = f"Cannot listen on {host}:{port}: {error.strerror}."
            raise ConfigError(words, hint="Choose another --port.") from error
        self.planner = planner
        self.limits = limits
        self.turn = threading.Lock()
        self.numbers = count(1)


class _Exchange(BaseHTTPRequestHandler):
    """One request."""

    protocol_version = "HTTP/1.1"
    server: ServedEndpoint  # type: ignore[assignment]

    def do_GET(self) -> None:
        """List the models, or say that the server is well."""
        if self.path.rstrip("/").endswith("/models"):
            one = {"id": self.server.planner.id, "object": "model", "created": 0, "owned_by": "chauffeur"}
            self._json(200, {"object": "list", "data": [one]})
        elif self.path.rstrip("/") in ("", "/health", "/v1"):
            self._json(200, {"status": "ok", "model": self.server.planner.model})
        else:
            self._fail(404, f"There is nothing at {self.path}.")

    def do_POST(self) -> None:
        """Answer a conversation."""
        from chauffeur.planners.onboard.served import reply_to

        body = self._body()
        if body is None:
            return
        if not self.path.rstrip("/").endswith("/chat/completions"):
            self._fail(404, f"There is nothing at {self.path}; post to /v1/chat/completions.")
            return
        messages = body.get("messages")
        if not isinstance(messages, list) or not all(isinstance(m, dict) for m in messages):
            self._fail(400, "`messages` must be a list of objects with `role` and `content`.")
            return
        try:
            with self.server.turn:
                text, plan = asyncio.run(reply_to(self.server.planner, messages, self.server.limits))
        except ValueError as error:
            self._fail(400, str(error))
            return
        except ChauffeurError as error:
            self._fail(500, str(error))
            return
        about: dict[str, Any] = {
            "id": f"chatcmpl-{next(self.server.numbers)}",
            "created": int(time.time()),
            "model": self.server.planner.id,
        }
        usage = {"prompt_tokens": plan.usage.prompt_tokens, "completion_tokens": plan.usage.completion_tokens}
        usage["total_tokens"] = sum(usage.values())
        if body.get("stream"):
            self._stream(about, text, usage)
            return
        message = {"role": "assistant", "content": text}
        choice = {"index": 0, "message": message, "finish_reason": "stop"}
        self._json(200, {**about, "object": "chat.completion", "choices": [choice], "usage": usage})

    def _body(self) -> dict[str, Any] | None:
        try:
            length = int(self.headers.get("Content-Length", "0"))
        except ValueError:
            length = 0
        if length > MAX_BODY_BYTES:
            self._fail(413, f"A request has at most {MAX_BODY_BYTES} bytes.")
            return None
        try:
            body = json.loads(self.rfile.read(length))
        except ValueError:
            body = None
        if not isinstance(body, dict):
            self._fail(400, "The body is not a JSON object.")
            return None
        return body

    def _stream(self, about: dict[str, Any], text: str, usage: dict[str, int]) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "text/event-stream")
        self.send_header("Connection", "close")
        self.end_headers()
        self.close_connection = True
        pieces = [text[i : i + _PIECE_CHARS] for i in range(0, len(text), _PIECE_CHARS)]
        deltas: list[tuple[dict[str, str], str | None]] = [({"role": "assistant"}, None)]
        deltas += [({"content": piece}, None) for piece in pieces]
        deltas.append(({}, "stop"))
        try:
            for delta, reason in deltas:
                choice = {"index": 0, "delta": delta, "finish_reason": reason}
                self._event({**about, "object": "chat.completion.chunk", "choices": [choice]})
            self._event({**about, "object": "chat.completion.chunk", "choices": [], "usage": usage})
            self.wfile.write(b"data: [DONE]\n\n")
        except OSError:
            return  # the client has gone

    def _event(self, value: dict[str, Any]) -> None:
        self.wfile.write(f"data: {json.dumps(value, ensure_ascii=False)}\n\n".encode())
        self.wfile.flush()

    def _json(self, status: int, value: dict[str, Any]) -> None:
        content = json.dumps(value, ensure_ascii=False).encode()
        self.send_response(status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    def _fail(self, status: int, words: str) -> None:
        self.close_connection = True
        self._json(status, {"error": {"message": words, "type": "invalid_request_error", "code": status}})

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing: wishes are personal."""
