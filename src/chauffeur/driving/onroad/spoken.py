"""Wishes by voice for a session on a real vehicle: the microphone is listened to beside it, in its event loop.

    attention = Attention(engine, sound, voice, show, act)
    async with listening(attention, trouble):
        ...

What the speech engine is not sure of is asked back and acted on only after a yes, as in `chauffeur talk`; nothing here
knows the vehicle.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from typing import Final

from chauffeur.concept import ChauffeurError
from chauffeur.driving.talk.attention import Attention

LOOK_EVERY_S: Final = 0.01
"""Period of looking for what was heard."""

_log = logging.getLogger(__name__)


@asynccontextmanager
async def listening(attention: Attention, trouble: Callable[[str], None]) -> AsyncGenerator[None]:
    """Listen as long as this is entered.

    Args:
        attention: Not started yet; it is closed at the end.
        trouble: Told, in words, that listening broke off; typing goes on.

    Raises:
        ChauffeurError: The speech engine cannot be had.
    """
    await asyncio.to_thread(attention.start)
    task = asyncio.create_task(_listen(attention, trouble))
    try:
        yield
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        attention.close()


async def _listen(attention: Attention, trouble: Callable[[str], None]) -> None:
    try:
        while True:
            attention.poll()
            await asyncio.sleep(LOOK_EVERY_S)
    except Exception as error:  # noqa: BLE001 - a fault of hearing ends hearing, not the session
        if not isinstance(error, ChauffeurError):
            _log.exception("listening failed")
        trouble(f"Listening broke off: {error}. Type what you want.")
