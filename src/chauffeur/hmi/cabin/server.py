"""The cabin page's server, in a thread of its own: a session says things and takes what it is told, and never waits."""

from __future__ import annotations

import asyncio
import queue
import threading
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from types import TracebackType
from typing import Final

from chauffeur.driving.talk.messages import Note, Said, Told
from chauffeur.hmi.cabin.room import CabinRoom
from chauffeur.hmi.local_page import HOST, Certificate, LocalPage, PageFile

MOST_MESSAGE_BYTES: Final = 1 << 16
"""Of a page: the longest text is 2,000 characters; sound comes in pieces of a tenth of a second (3,200 bytes)."""
MOST_SOUND_BYTES: Final = 20 * 32_000
"""Sound that may wait for the session, 20 s of it."""
_TOO_MUCH_SOUND: Final = Note("Some of the sound was lost: the car does not keep up with listening.", trouble=True)
_FAREWELL_S: Final = 1.0

_PACKAGE: Final = "chauffeur.hmi.cabin"
_MODULES: Final = (
    *("cabin", "conversation", "elements", "hands", "link", "memory", "microphone"),
    *("recorder", "resample", "scene", "words"),
)
_SHARED: Final = "chauffeur.hmi"
_FILES: Final = {
    "": PageFile(_PACKAGE, "cabin.html", "text/html"),
    "cabin.css": PageFile(_PACKAGE, "cabin.css", "text/css"),
    "scene.css": PageFile(_SHARED, "scene.css", "text/css"),
    "drawer.js": PageFile(_SHARED, "drawer.js", "text/javascript"),
    **{f"{name}.js": PageFile(_PACKAGE, f"{name}.js", "text/javascript") for name in _MODULES},
}


class Cabin:
    """The page of one session. A context: it serves from entering to leaving, and the page hears of the end.

    `tell` and `take` are for any thread. The page asks nothing of the session but that it goes on taking: sound that is
    not taken for 20 s is dropped, and the page says so.
    """

    def __init__(self, *, port: int = 0, host: str = HOST, certificate: Certificate | None = None) -> None:
        """Prepare the page.

        Args:
            port: TCP port; 0 takes a free one.
            host: Name or number the page is reached at. Anything but this machine alone needs a certificate.
            certificate: For other machines, encrypted.

        Raises:
            ConfigError: Other machines could read along, or the certificate is none.
        """
        self._page = LocalPage(_FILES, "talk", microphone=True, host=host, certificate=certificate)
        self._port = port
        self._inbox: queue.SimpleQueue[Told | bytes] = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._sound_bytes = 0
        self._complained = False
        self._room = CabinRoom(self._hand_on)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._leave: asyncio.Event | None = None
        self._thread: threading.Thread | None = None

    @property
    def url(self) -> str:
        """Address of the page, token included; known once the context is entered."""
        return self._page.url

    def __enter__(self) -> Cabin:
        """Serve.

        Raises:
            MissingExtraError: The server's package is not installed.
            ConfigError: The address cannot be used.
        """
        begun: Future[None] = Future()
        self._thread = threading.Thread(target=self._run, args=(begun,), name="cabin page", daemon=True)
        self._thread.start()
        begun.result()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Tell the screens what was said last, and close."""
        if self._leave is not None:
            self._post(self._leave.set)
        if self._thread is not None:
            self._thread.join()

    def tell(self, said: Said) -> None:
        """Show something on every screen. Never waits; after the end, nothing happens."""
        self._post(lambda: self._room.tell(said))

    def take(self, wait_s: float = 0.0) -> Told | bytes | None:
        """What the page said next, in order: a message, or sound (16 kHz, 16 bit, little-endian, mono).

        Args:
            wait_s: How long to wait for it.

        Returns:
            None where nothing came.
        """
        try:
            told = self._inbox.get(timeout=wait_s) if wait_s > 0.0 else self._inbox.get_nowait()
        except queue.Empty:
            return None
        if isinstance(told, bytes):
            with self._lock:
                self._sound_bytes -= len(told)
                self._complained = self._complained and self._sound_bytes > 0
        return told

    def _hand_on(self, told: Told | bytes) -> None:
        if not isinstance(told, bytes) or self._has_room_for(len(told)):
            self._inbox.put(told)

    def _has_room_for(self, sound_bytes: int) -> bool:
        """Whether the session keeps up; where it does not, the page says so once."""
        with self._lock:
            if self._sound_bytes + sound_bytes <= MOST_SOUND_BYTES:
                self._sound_bytes += sound_bytes
                return True
            complained, self._complained = self._complained, True
        if not complained:
            self._room.tell(_TOO_MUCH_SOUND)
        return False

    def _post(self, work: Callable[[], None]) -> None:
        loop = self._loop
        if loop is not None:
            with suppress(RuntimeError):  # the page was closed meanwhile
                loop.call_soon_threadsafe(work)

    def _run(self, begun: Future[None]) -> None:
        try:
            asyncio.run(self._serve(begun))
        except BaseException as error:
            if begun.done():
                raise
            begun.set_exception(error)

    async def _serve(self, begun: Future[None]) -> None:
        async with self._page.serving(
            self._room.talk, port=self._port, most_bytes=MOST_MESSAGE_BYTES, purpose="The cabin page"
        ):
            self._leave = asyncio.Event()
            self._loop = asyncio.get_running_loop()
            begun.set_result(None)
            await self._leave.wait()
            await self._say_farewell()
            self._loop = None

    async def _say_farewell(self) -> None:
        """A second at most for what was said last; a screen that does not read is not waited for."""
        loop = asyncio.get_running_loop()
        until = loop.time() + _FAREWELL_S
        while not self._room.heard_out and loop.time() < until:
            await asyncio.sleep(0.02)
        self._room.close()
