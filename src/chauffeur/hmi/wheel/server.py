"""The page's server: this machine only, one page at a time, and nobody without the token.

Any web page open in the person's browser can reach a server on this machine, so each request must show three things
that a foreign page cannot: the random token in its path, a Host that is this machine by name or number (a name that
was made to point here is refused), and, to drive, the page's own Origin.
"""

from __future__ import annotations

import asyncio
import hmac
import logging
import secrets
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from http import HTTPStatus
from importlib import resources
from typing import TYPE_CHECKING

from chauffeur.concept import ConfigError, DataError, MissingExtraError
from chauffeur.hmi.wheel.protocol import MAX_MESSAGE_BYTES, parse
from chauffeur.hmi.wheel.session import Session

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

HOST = "127.0.0.1"
TAKEN_OVER = 4001
"""WebSocket close code: another page has taken the wheel."""
NOT_UNDERSTOOD = 4002
"""WebSocket close code: the page said something that is no message."""

_ASSETS = {
    "": ("wheel.html", "text/html"),
    "wheel.css": ("wheel.css", "text/css"),
    "draw.js": ("draw.js", "text/javascript"),
    "wheel.js": ("wheel.js", "text/javascript"),
}
_SOCKET = "drive"
_HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",  # the token stands in the address
    "X-Content-Type-Options": "nosniff",
}


class WheelServer:
    """Serves the page and carries its words; made by `serving`."""

    def __init__(self, session: Session, token: str) -> None:
        self._session = session
        self._token = token
        self._port = 0
        self._driver: ServerConnection | None = None

    @property
    def url(self) -> str:
        """Address of the page, token included."""
        return f"http://{HOST}:{self._port}/{self._token}/"

    def bound(self, port: int) -> None:
        """The port the server listens on."""
        self._port = port

    def admit(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer a request for a file, refuse what may not pass; None lets a WebSocket handshake go on."""
        names = (f"{HOST}:{self._port}", f"localhost:{self._port}")
        if request.headers.get_all("Host") not in [[name] for name in names]:
            return _answer(connection, HTTPStatus.MISDIRECTED_REQUEST, "This server answers to its own address only.")
        token, _, rest = request.path.removeprefix("/").partition("/")
        if not hmac.compare_digest(token.encode(), self._token.encode()):
            return _answer(connection, HTTPStatus.FORBIDDEN, "Open the address that the command printed.")
        if rest == _SOCKET:
            origins = request.headers.get_all("Origin")
            if origins not in [[f"http://{name}"] for name in names]:
                return _answer(connection, HTTPStatus.FORBIDDEN, "Only the page itself may drive.")
            return None
        if rest not in _ASSETS:
            return _answer(connection, HTTPStatus.NOT_FOUND, "There is nothing here.")
        name, kind = _ASSETS[rest]
        text = resources.files("chauffeur.hmi.wheel").joinpath("assets", name).read_text(encoding="utf-8")
        return _answer(connection, HTTPStatus.OK, text, kind)

    async def drive(self, connection: ServerConnection) -> None:
        """Carry words between a page and the session until the page goes, or another takes its place."""
        from websockets.exceptions import ConnectionClosed

        if self._driver is not None:
            await self._driver.close(TAKEN_OVER, "another page has the wheel")
        self._driver = connection
        telling = asyncio.create_task(self._tell(connection))
        try:
            async for message in connection:
                if self._driver is connection:
                    self._session.hear(parse(message))
        except DataError as error:
            await connection.close(NOT_UNDERSTOOD, error.message)
        except ConnectionClosed:
            pass  # a page that goes without a word; the drive pauses by itself
        finally:
            telling.cancel()
            if self._driver is connection:
                self._driver = None

    async def _tell(self, connection: ServerConnection) -> None:
        from websockets.exceptions import ConnectionClosed

        try:
            async for text in self._session.screen.follow():
                await connection.send(text)
        except ConnectionClosed:
            pass


def _answer(connection: ServerConnection, status: HTTPStatus, text: str, kind: str = "text/plain") -> Response:
    response = connection.respond(status, text)
    del response.headers["Content-Type"]
    response.headers["Content-Type"] = f"{kind}; charset=utf-8"
    for name, value in _HEADERS.items():
        response.headers[name] = value
    return response


@asynccontextmanager
async def serving(session: Session, port: int = 0) -> AsyncGenerator[WheelServer]:
    """Serve a session's page on this machine.

    Args:
        session: What is shown and driven.
        port: TCP port; 0 takes a free one.

    Raises:
        MissingExtraError: The server's package is not installed.
        ConfigError: The port is taken.
    """
    try:
        from websockets.asyncio.server import serve
    except ImportError as error:
        raise MissingExtraError(
            "Driving by hand needs the package websockets.", hint='Install it with: pip install "chauffeur[page]"'
        ) from error
    wheel = WheelServer(session, secrets.token_urlsafe(18))
    # Its messages about strangers' broken handshakes are no concern of the person's terminal.
    quiet = logging.getLogger("chauffeur.hmi.wheel")
    quiet.setLevel(logging.CRITICAL)
    try:
        server = await serve(
            wheel.drive,
            HOST,
            port,
            process_request=wheel.admit,
            compression=None,
            max_size=MAX_MESSAGE_BYTES,
            logger=quiet,
            close_timeout=1,
        )
    except OSError as error:
        raise ConfigError(f"Port {port} cannot be used: {error.strerror}.", hint="Choose another, or 0.") from error
    async with server:
        wheel.bound(server.sockets[0].getsockname()[1])
        yield wheel
