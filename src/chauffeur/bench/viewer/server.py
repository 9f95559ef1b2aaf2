"""The viewer's server: the page, and a socket on which it asks and hears what has changed."""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager, suppress
from typing import TYPE_CHECKING, Any, Final

from chauffeur.bench.viewer.content import Content
from chauffeur.bench.viewer.page import inline_sources, render_view
from chauffeur.concept import ChauffeurError
from chauffeur.hmi.local_page import LocalPage, PageText

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection

_log = logging.getLogger(__name__)

MOST_MESSAGE_BYTES: Final = 1 << 12
"""Of a page: a question names runs by ids of twelve letters."""
LOOK_S: Final = 1.0
"""How often the folders are looked at while a page is open."""
_REST: Final = 5.0
"""Rest between two looks, in times of what a look takes: folders by the thousand do not keep a core busy."""
_AT_ONCE: Final = 4
"""Questions of one page that are worked on at a time."""


class Viewer:
    """Serves the page of some runs and trips to this machine."""

    def __init__(self, content: Content) -> None:
        self._content = content
        self._page = LocalPage({"": PageText(render_view(), "text/html")}, "talk", inline=inline_sources())
        self._screens: set[ServerConnection] = set()
        self._index = ""

    @property
    def url(self) -> str:
        """Address of the page, token included; known while it is served."""
        return self._page.url

    @asynccontextmanager
    async def serving(self, port: int = 0) -> AsyncGenerator[None]:
        """Serve while the context lasts.

        Args:
            port: TCP port; 0 takes a free one.

        Raises:
            MissingExtraError: The server's package is not installed.
            ConfigError: The port cannot be used.
        """
        async with self._page.serving(self._talk, port=port, most_bytes=MOST_MESSAGE_BYTES, purpose="The viewer"):
            watching = asyncio.create_task(self._watch())
            try:
                yield
            finally:
                watching.cancel()
                for screen in list(self._screens):
                    await screen.close()

    async def _watch(self) -> None:
        """Tell every page what has changed."""
        loop = asyncio.get_running_loop()
        took_s = 0.0
        while True:
            await asyncio.sleep(max(LOOK_S, _REST * took_s))
            if not self._screens:
                continue
            began_s = loop.time()
            index = json.dumps({"index": await asyncio.to_thread(self._content.index)})
            took_s = loop.time() - began_s
            if index != self._index:
                self._index = index
                for screen in list(self._screens):
                    await _send(screen, index)

    async def _talk(self, connection: ServerConnection) -> None:
        from websockets.exceptions import ConnectionClosed

        self._screens.add(connection)
        places = asyncio.Semaphore(_AT_ONCE)
        try:
            async with asyncio.TaskGroup() as group:
                async for message in connection:
                    group.create_task(self._reply(connection, message, places))
        except* ConnectionClosed:
            pass  # a page that was closed without a word
        finally:
            self._screens.discard(connection)

    async def _reply(self, connection: ServerConnection, message: str | bytes, places: asyncio.Semaphore) -> None:
        number: Any = None
        try:
            asked: Any = json.loads(message)
            number, key = asked["n"], str(asked["key"])
            async with places:
                answer = await asyncio.to_thread(self._answer, key)
            text = json.dumps({"n": number, "answer": answer}, ensure_ascii=False)
        except ChauffeurError as error:
            text = json.dumps({"n": number, "trouble": str(error)})
        except Exception as error:  # noqa: BLE001 - a run's files may hold anything; the page goes on with the others
            _log.debug("an answer failed", exc_info=True)
            text = json.dumps({"n": number, "trouble": f"It cannot be shown ({type(error).__name__}: {error})."})
        await _send(connection, text.encode("utf-8", "replace").decode())

    def _answer(self, key: str) -> Any:
        """The answer to a question by its key. Raises ChauffeurError; LookupError or ValueError: not a question."""
        what, *of = key.split(" ")
        plain: dict[str, Callable[..., Any]] = {
            "index": self._content.index,
            "report": self._content.report,
            "matches": self._content.matches,
            "rows": self._content.rows,
            "trip": self._content.trip,
        }
        numbered = {"sample": self._content.sample, "drive": self._content.drive}
        if what in numbered:
            name, place = of
            return numbered[what](name, int(place))
        return plain[what](*of)


async def _send(connection: ServerConnection, text: str) -> None:
    from websockets.exceptions import ConnectionClosed

    with suppress(ConnectionClosed):  # it has gone meanwhile
        await connection.send(text)
