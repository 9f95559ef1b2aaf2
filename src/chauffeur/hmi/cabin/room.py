"""Who looks at the cabin page, and which of the screens has the wheel. Kept by one event loop.

Every screen sees everything. One has the wheel: what it says goes to the session. A screen that joins while no other
has it gets it, and so does one that comes back after its connection was lost; any other takes it on its own word. To
stop the car, no screen needs it.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Final, Literal

from chauffeur.driving.live.messages import MessageError
from chauffeur.driving.talk.messages import Button, Said, Stop, Told, read_told
from chauffeur.hmi.cabin.board import LatestMessages, Outbox

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection

NOT_UNDERSTOOD: Final = 4002
"""WebSocket close code: the page said something that is no message."""
TAKE_WHEEL: Final = '{"kind":"wheel"}'
"""How a page asks for the wheel, to the letter."""


class CabinRoom:
    """Screens around one session."""

    def __init__(self, hand_on: Callable[[Told | bytes], None]) -> None:
        """An empty room.

        Args:
            hand_on: Takes what is told, and sound, to the session; must not wait.
        """
        self._hand_on = hand_on
        self._board = LatestMessages()
        self._screens: dict[ServerConnection, Outbox] = {}
        self._wheel: ServerConnection | None = None
        self._held: set[Literal["command", "evaluate"]] = set()

    @property
    def heard_out(self) -> bool:
        """Whether every screen was told everything."""
        return all(outbox.empty for outbox in self._screens.values())

    def close(self) -> None:
        """Hold up nobody for screens that do not read."""
        for connection, outbox in list(self._screens.items()):
            if not outbox.empty:
                self._let_go(connection)

    def tell(self, said: Said) -> None:
        """To every screen."""
        self._spread(*self._board.write(said))

    async def talk(self, connection: ServerConnection) -> None:
        """Carry words between a screen and the session until the screen goes."""
        from websockets.exceptions import ConnectionClosed

        outbox = self._screens[connection] = Outbox(self._board.backlog())
        if self._wheel is None:
            self._wheel = connection
        self._tell_places()
        telling = asyncio.create_task(self._send(connection, outbox))
        try:
            async for message in connection:
                self._hear(connection, message)
        except MessageError as error:
            await connection.close(NOT_UNDERSTOOD, str(error))
        except ConnectionClosed:
            pass  # a screen that goes without a word; the drive does not depend on it
        finally:
            telling.cancel()
            self._leave(connection)

    async def _send(self, connection: ServerConnection, outbox: Outbox) -> None:
        from websockets.exceptions import ConnectionClosed

        try:
            async for text in outbox.follow():
                await connection.send(text)
        except ConnectionClosed:
            pass

    def _hear(self, connection: ServerConnection, message: str | bytes) -> None:
        if message == TAKE_WHEEL:
            self._take_wheel(connection)
            return
        if isinstance(message, bytes):
            if len(message) % 2:
                raise MessageError("sound with half a sample")
            if connection is self._wheel:
                self._hand_on(message)
            return
        told = read_told(message)
        if connection is not self._wheel and not isinstance(told, Stop):
            return  # said before it knew that another screen has the wheel
        match told:
            case Button(button=button, held=True):
                self._held.add(button)
            case Button(button=button):
                self._held.discard(button)
            case _:
                pass
        self._hand_on(told)

    def _take_wheel(self, connection: ServerConnection | None) -> None:
        """The wheel goes to a screen, or to none. Buttons that were held on the other are let go."""
        if connection is not self._wheel:
            for button in sorted(self._held):
                self._hand_on(Button(button, held=False))
            self._held.clear()
        self._wheel = connection
        self._tell_places()

    def _leave(self, connection: ServerConnection) -> None:
        self._screens.pop(connection, None)
        if connection is self._wheel:
            self._take_wheel(None)
        else:
            self._tell_places()

    def _tell_places(self) -> None:
        for connection, outbox in self._screens.items():
            wheel = "free" if self._wheel is None else "mine" if connection is self._wheel else "taken"
            place = {"kind": "place", "wheel": wheel, "screens": len(self._screens)}
            outbox.put(json.dumps(place), "place")

    def _spread(self, text: str, key: str = "") -> None:
        for connection, outbox in list(self._screens.items()):
            outbox.put(text, key)
            if outbox.full:
                self._let_go(connection)

    def _let_go(self, connection: ServerConnection) -> None:
        """Of a screen that does not read: no word of farewell would reach it. It may come back and begin anew."""
        del self._screens[connection]
        connection.transport.abort()
