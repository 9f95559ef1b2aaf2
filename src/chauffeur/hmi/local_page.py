"""Serving a page that talks back: on this machine unless told otherwise, and to nobody without the token.

Any web page open in the person's browser can reach a server on this machine, so each request must show three things
that a foreign page cannot: the random token in its path, a Host that is this server by name or number (a name that
was made to point here is refused), and, to talk, the page's own Origin. What is served loads nothing from elsewhere.

Who has not shown them yet takes a place at the door (`_Door`): there are few, a newcomer gets the place of whoever has
stood there longest, and nobody stands there for more than seconds. So strangers cannot use up what the drive needs.
"""

from __future__ import annotations

import hmac
import ipaddress
import logging
import secrets
import socket
import ssl
from collections.abc import AsyncGenerator, Awaitable, Callable, Mapping, Sequence
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from http import HTTPStatus
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from chauffeur.concept import ConfigError, MissingExtraError

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

HOST: Final = "127.0.0.1"
"""This machine alone."""
MOST_AT_THE_DOOR: Final = 32
"""Connections that have not shown the token. A page opens some ten at once for its files."""
MOST_SCREENS: Final = 32
"""Connections that talk."""
AT_THE_DOOR_S: Final = 5.0
"""How long a connection may take to show the token, after as long again to agree on encryption."""

_HEADERS: Final = {
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",  # the token stands in the address
    "X-Content-Type-Options": "nosniff",
}
_POLICY: Final = (
    "default-src 'none'; script-src {own}; style-src {own}; connect-src 'self'; "
    "img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_PERMISSIONS: Final = "camera=(), display-capture=(), geolocation=(), payment=(), usb=(), microphone="


@dataclass(frozen=True, slots=True)
class PageFile:
    """A file of the folder `assets` of a package, and its media type."""

    package: str
    name: str
    kind: str

    @property
    def text(self) -> str:
        """Its content."""
        return resources.files(self.package).joinpath("assets", self.name).read_text(encoding="utf-8")


@dataclass(frozen=True, slots=True)
class PageText:
    """Content that was put together, and its media type."""

    text: str
    kind: str


@dataclass(frozen=True, slots=True)
class Certificate:
    """Two PEM files that let a server be reached from other machines, encrypted."""

    chain: Path
    key: Path


class LocalPage:
    """A page, where it is, and who may open it."""

    def __init__(
        self,
        files: Mapping[str, PageFile | PageText],
        socket: str,
        *,
        microphone: bool = False,
        inline: Sequence[str] = (),
        host: str = HOST,
        certificate: Certificate | None = None,
    ) -> None:
        """A page with a new token.

        Args:
            files: What is served, by the path behind the token; the page itself at the empty one.
            socket: Path of the WebSocket behind the token.
            microphone: Whether the page may ask for it.
            inline: Hashes of styles and scripts that stand in the page itself (`document.content_hash`).
            host: Name or number of this server; anything but this machine alone needs a certificate.
            certificate: For that.

        Raises:
            ConfigError: Other machines could reach the page, and read along.
        """
        if host in ("", "0.0.0.0", "::"):  # noqa: S104 - refused
            raise ConfigError(
                f"The page needs one name or number of its own, not {host!r}.", hint="Give the one that is opened."
            )
        if certificate is None and not _is_loopback(host):
            raise ConfigError(
                f"The page would be open to the network at {host} without encryption.",
                hint="Give a certificate and its key, or leave the address out: then only this machine can open it.",
            )
        self._files = files
        self._socket = socket
        self._host = host
        self._port = 0
        self._token = secrets.token_urlsafe(18)
        self._tls = _tls(certificate)
        self._door: _Door | None = None
        own = " ".join(("'self'", *inline))
        self._headers = _HEADERS | {
            "Content-Security-Policy": _POLICY.format(own=own),
            "Permissions-Policy": _PERMISSIONS + ("(self)" if microphone else "()"),
        }

    @property
    def url(self) -> str:
        """Address of the page, token included."""
        return f"{self._origins()[0]}/{self._token}/"

    def _names(self) -> list[str]:
        shown = f"[{self._host}]" if ":" in self._host else self._host
        names = [f"{shown}:{self._port}"]
        return [*names, f"localhost:{self._port}"] if _is_loopback(self._host) else names

    def _origins(self) -> list[str]:
        scheme = "http" if self._tls is None else "https"
        return [f"{scheme}://{name}" for name in self._names()]

    def admit(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer a request for a file, refuse what may not pass; None lets a WebSocket handshake go on."""
        if request.headers.get_all("Host") not in [[name] for name in self._names()]:
            return self._answer(connection, HTTPStatus.MISDIRECTED_REQUEST, "This server answers to its own name only.")
        token, _, rest = request.path.removeprefix("/").partition("/")
        if not hmac.compare_digest(token.encode(), self._token.encode()):
            return self._answer(connection, HTTPStatus.FORBIDDEN, "Open the address that the command printed.")
        if rest == self._socket:
            if request.headers.get_all("Origin") not in [[origin] for origin in self._origins()]:
                return self._answer(connection, HTTPStatus.FORBIDDEN, "Only the page itself may talk to this server.")
            own: socket.socket = connection.transport.get_extra_info("socket")
            if self._door is not None and not self._door.admit(own.fileno()):
                return self._answer(connection, HTTPStatus.SERVICE_UNAVAILABLE, "Too many screens look at this drive.")
            return None
        file = self._files.get(rest)
        if file is None:
            return self._answer(connection, HTTPStatus.NOT_FOUND, "There is nothing here.")
        return self._answer(connection, HTTPStatus.OK, file.text, file.kind)

    def _answer(
        self, connection: ServerConnection, status: HTTPStatus, text: str, kind: str = "text/plain"
    ) -> Response:
        response = connection.respond(status, text)
        del response.headers["Content-Type"]
        response.headers["Content-Type"] = f"{kind}; charset=utf-8"
        for name, value in self._headers.items():
            response.headers[name] = value
        return response

    @asynccontextmanager
    async def serving(
        self,
        talk: Callable[[ServerConnection], Awaitable[None]],
        *,
        port: int = 0,
        most_bytes: int,
        purpose: str,
    ) -> AsyncGenerator[None]:
        """Serve the page while the context lasts.

        Args:
            talk: Carries a WebSocket that was let in.
            port: TCP port; 0 takes a free one.
            most_bytes: A longer message ends its connection.
            purpose: What needs the server's package, as an error says it.

        Raises:
            MissingExtraError: The server's package is not installed.
            ConfigError: The address cannot be used.
        """
        try:
            from websockets.asyncio.server import serve
        except ImportError as error:
            raise MissingExtraError(f"{purpose} needs the package websockets.", extra="page") from error
        # Its messages about strangers' broken handshakes are no concern of the person's terminal.
        quiet = logging.getLogger("chauffeur.hmi.local_page")
        quiet.setLevel(logging.CRITICAL)
        try:
            self._door = _Door.at(self._host, port)
            server = await serve(
                talk,
                sock=self._door,
                process_request=self.admit,
                compression=None,
                max_size=most_bytes,
                logger=quiet,
                open_timeout=AT_THE_DOOR_S,
                close_timeout=1,
                backlog=_BACKLOG,
                ssl=self._tls,
                ssl_handshake_timeout=None if self._tls is None else AT_THE_DOOR_S,
            )
        except OSError as error:
            where = f"Port {port}" if self._host == HOST else f"{self._host}, port {port},"
            why = error.strerror or str(error)
            raise ConfigError(f"{where} cannot be used: {why}.", hint="Choose another, or 0.") from error
        async with server:
            self._port = server.sockets[0].getsockname()[1]
            yield


class _Door(socket.socket):
    """A listening socket that knows who came in and has not been admitted yet, and lets no crowd gather."""

    _waiting: list[socket.socket]
    _screens: list[socket.socket]

    @classmethod
    def at(cls, host: str, port: int) -> _Door:
        """Bound to the first address of a host.

        Raises:
            OSError: The address cannot be used.
        """
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        door = cls(family, kind, protocol)
        try:
            door.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, True)
            door.setblocking(False)
            door.bind(address)
        except BaseException:
            door.close()
            raise
        door._waiting, door._screens = [], []
        return door

    def accept(self) -> tuple[socket.socket, Any]:
        """Take the next connection; where too many have shown nothing yet, the one that came first has to go."""
        connection, address = super().accept()
        self._waiting = [one for one in self._waiting if one.fileno() >= 0]
        for oldest in self._waiting[: max(0, 1 + len(self._waiting) - MOST_AT_THE_DOOR)]:
            with suppress(OSError):  # it has gone by itself
                oldest.shutdown(socket.SHUT_RDWR)  # its own loop hears of it, and closes it
        self._waiting.append(connection)
        return connection, address

    def admit(self, number: int) -> bool:
        """Let the connection with this file descriptor stay; False where there are too many already."""
        self._screens = [one for one in self._screens if one.fileno() >= 0]
        if len(self._screens) >= MOST_SCREENS:
            return False
        self._screens += [one for one in self._waiting if one.fileno() == number]
        self._waiting = [one for one in self._waiting if one.fileno() != number]
        return True


_BACKLOG: Final = 16
"""Connections that wait to be taken: the loop takes so many at once before it closes any."""


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _tls(certificate: Certificate | None) -> ssl.SSLContext | None:
    if certificate is None:
        return None
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    try:
        context.load_cert_chain(certificate.chain, certificate.key)
    except (OSError, ssl.SSLError) as error:
        raise ConfigError(
            f"{certificate.chain} and {certificate.key} are no certificate and key: {error.strerror or error}.",
            hint="Both are PEM files; the key must not be encrypted and must belong to the certificate.",
        ) from error
    return context
