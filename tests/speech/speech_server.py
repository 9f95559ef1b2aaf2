"""A real transcription server on loopback: takes the multipart form apart and answers in the protocol's own format."""

from __future__ import annotations

import json
import threading
import time
from dataclasses import dataclass, field
from email.parser import BytesParser
from email.policy import HTTP
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any


@dataclass
class Answer:
    """What the server says, and how."""

    status: int = 200
    body: bytes = b'{"text": "Command: slow down."}'
    headers: dict[str, str] = field(default_factory=dict)
    wait_s: float = 0.0
    drip_s: float = 0.0
    hang_up: bool = False


@dataclass
class Request:
    """What the server got."""

    path: str
    headers: dict[str, str]
    fields: dict[str, str]
    file: bytes
    file_name: str
    file_type: str


class TranscriptionServer:
    """Answers every request with `answer`, and keeps what it was asked."""

    def __init__(self) -> None:
        self.answer = Answer()
        self.requests: list[Request] = []
        self.done = threading.Event()
        owner = self

        class Handler(BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_POST(self) -> None:
                owner._serve(self)

            def log_message(self, format: str, *args: Any) -> None:
                pass

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._server.daemon_threads = True
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.02,), daemon=True)
        self._thread.start()
        self.url = f"http://127.0.0.1:{self._server.server_port}/v1"

    def say(self, text: str = "", status: int = 200, **more: Any) -> None:
        """Answer with this text, or with these fields, from now on."""
        body = json.dumps(more.pop("fields", {"text": text})).encode()
        self.answer = Answer(status, more.pop("body", body), **more)

    def _serve(self, handler: BaseHTTPRequestHandler) -> None:
        body = handler.rfile.read(int(handler.headers["content-length"]))
        whole = b"content-type: " + handler.headers["content-type"].encode() + b"\r\n\r\n" + body
        fields: dict[str, str] = {}
        file, file_name, file_type = b"", "", ""
        for part in BytesParser(policy=HTTP).parsebytes(whole).iter_parts():
            name = part.get_param("name", header="content-disposition")
            content = part.get_payload(decode=True)
            if part.get_filename():
                file, file_name, file_type = content, part.get_filename(), part.get_content_type()
            else:
                fields[str(name)] = content.decode()
        headers = {name.lower(): value for name, value in handler.headers.items()}
        self.requests.append(Request(handler.path, headers, fields, file, file_name, file_type))
        answer = self.answer
        self.done.wait(answer.wait_s)
        if answer.hang_up:
            handler.close_connection = True
            return
        try:
            handler.send_response(answer.status)
            for name, value in {"Content-Type": "application/json", **answer.headers}.items():
                handler.send_header(name, value)
            handler.send_header("Content-Length", str(len(answer.body)))
            handler.end_headers()
            if answer.drip_s == 0.0:
                handler.wfile.write(answer.body)
            for at in range(len(answer.body) if answer.drip_s else 0):
                handler.wfile.write(answer.body[at : at + 1])
                handler.wfile.flush()
                if self.done.wait(answer.drip_s):
                    return
        except OSError:
            handler.close_connection = True

    def close(self) -> None:
        self.done.set()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join(timeout=5)


def wait_until(true: Any, seconds: float = 5.0) -> None:
    """Wait until something is true."""
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, "it did not become true"
        time.sleep(0.01)
