"""A real session with its cabin page: real processes that drive, plan and hear, in a thread of the test."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import Any

from chauffeur.driving.live.settings import Settings
from chauffeur.driving.live.starts import Start
from chauffeur.driving.scenarios import find
from chauffeur.driving.talk.asr_process import AsrEngine
from chauffeur.driving.talk.messages import Said, Told
from chauffeur.driving.talk.session import Talk
from chauffeur.hmi.cabin import Cabin

PATIENCE_S = 240.0


class Drive:
    """A drive as its session tells of it.

    Attributes:
        url: Of the page.
        told: Everything the page told the session, but for sound.
        sound_bytes: How much sound came.
    """

    def __init__(self, cabin: Cabin) -> None:
        self.url = cabin.url
        self.told: list[Told] = []
        self.sound_bytes = 0
        self._cabin = cabin
        self._said: list[Said] = []
        self._lock = threading.Lock()

    def hear(self, said: Said) -> None:
        """From the session, in its thread."""
        with self._lock:
            self._said.append(said)
        self._cabin.tell(said)

    def said(self, kind: str) -> list[Any]:
        """All messages of a kind so far."""
        with self._lock:
            return [said for said in self._said if said.kind == kind]

    def wish(self, text: str) -> Any:
        """What was last told of the newest wish in these words; older wishes are told of in between. None before."""
        return next((said for said in reversed(self.said("conversation")) if said.text == text), None)

    @property
    def scene(self) -> Any:
        """The newest."""
        return self.said("scene")[-1]

    def until(self, what: str, holds: Callable[[], object]) -> None:
        """Wait for something that the session tells."""
        until_s = time.monotonic() + PATIENCE_S
        while not holds():
            over = self.said("ended")
            assert not over, f"{what} did not come: {over}"
            assert time.monotonic() < until_s, f"{what} did not come: {self.said('note')}"
            time.sleep(0.02)


@contextmanager
def driving(
    scenario: str = "cruise", *, engine: str = "", planner: str = "meaning", speed: float = 0.4
) -> Generator[Drive]:
    """A drive with its page, from the first scene on; it ends with the context, the car standing or not."""
    # A road is a minute long: at less than real time, and with others after it, it outlasts the tests of a module.
    starts = tuple(Start(find(scenario), 5 + number, most_s=120.0) for number in range(8))
    settings = Settings(starts=starts, planner=planner, speed=speed, realtime=False)
    over = threading.Event()
    failed: list[BaseException] = []
    with Cabin() as cabin:
        drive = Drive(cabin)

        def run() -> None:
            try:
                with Talk(settings, drive.hear, engine=AsrEngine(engine) if engine else None) as talk:
                    while talk.driving and not over.is_set():
                        while (told := cabin.take(0.01)) is not None:
                            if isinstance(told, bytes):
                                drive.sound_bytes += len(told)
                            else:
                                drive.told.append(told)
                            talk.take(told)
                        talk.poll()
                    if talk.driving:
                        talk.abort()
            except BaseException as error:
                failed.append(error)

        thread = threading.Thread(target=run, name="session")
        thread.start()
        try:
            drive.until("a scene", lambda: failed or drive.said("scene"))
            yield drive
        finally:
            over.set()
            thread.join(PATIENCE_S)
    assert not failed, failed
