"""The page's server: this machine only, one page at a time, and nobody without the token (hmi/local_page.py)."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Final

from chauffeur.concept import DataError
from chauffeur.hmi.local_page import LocalPage, PageFile
from chauffeur.hmi.wheel.protocol import MAX_MESSAGE_BYTES, parse
from chauffeur.hmi.wheel.session import WheelSession

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection

TAKEN_OVER: Final = 4001
"""WebSocket close code: another page has taken the wheel."""
NOT_UNDERSTOOD: Final = 4002
"""WebSocket close code: the page said something that is no message."""

_PACKAGE: Final = "chauffeur.hmi.wheel"
_FILES: Final = {
    "": PageFile(_PACKAGE, "wheel.html", "text/html"),
    "wheel.css": PageFile(_PACKAGE, "wheel.css", "text/css"),
    "draw.js": PageFile(_PACKAGE, "draw.js", "text/javascript"),
    "wheel.js": PageFile(_PACKAGE, "wheel.js", "text/javascript"),
}


class WheelServer:
    """Carries the words of the page; made by `serving`."""

    def __init__(self, session: WheelSession, page: LocalPage) -> None:
        self._session = session
        self._page = page
        self._driver: ServerConnection | None = None

    @property
    def url(self) -> str:
        """Address of the page, token included."""
        return self._page.url

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


@asynccontextmanager
async def serving(session: WheelSession, port: int = 0) -> AsyncGenerator[WheelServer]:
    """Serve a session's page on this machine.

    Args:
        session: What is shown and driven.
        port: TCP port; 0 takes a free one.

    Raises:
        MissingExtraError: The server's package is not installed.
        ConfigError: The port is taken.
    """
    page = LocalPage(_FILES, "drive")
    wheel = WheelServer(session, page)
    async with page.serving(wheel.drive, port=port, most_bytes=MAX_MESSAGE_BYTES, purpose="Driving by hand"):
        yield wheel
