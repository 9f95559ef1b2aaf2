"""The view from the seat: rendered while somebody looks, for planners that look, and never in the way of the drive."""

from __future__ import annotations

import base64
import time
from collections.abc import Callable

import pytest

from chauffeur.concept import Observation
from chauffeur.driving.episode import make_world
from chauffeur.driving.live.settings import Settings
from chauffeur.driving.live.starts import Start
from chauffeur.driving.scenarios import find
from chauffeur.driving.talk import seat_view
from chauffeur.driving.talk.messages import Conversation, Said, Say, SeatView, ShowSeat
from chauffeur.driving.talk.seat_view import SeatWindow
from chauffeur.driving.talk.session import Talk

WITHIN_S = 120.0
PNG = b"\x89PNG\r\n"


def _until(holds: Callable[[], object], poll: Callable[[], None] = lambda: None) -> None:
    end_s = time.monotonic() + WITHIN_S
    while not holds():
        assert time.monotonic() < end_s
        poll()
        time.sleep(0.005)


def _seen() -> tuple[object, Observation]:
    place = find("left-lane")
    world = make_world(place)
    return world, world.reset(place, 1)


def test_a_picture_a_second_and_none_while_one_is_at_work() -> None:
    world, seen = _seen()
    window, made = SeatWindow(), list[SeatView]()

    def poll() -> None:
        if (view := window.news()) is not None:
            made.append(view)

    window.offer(world, 1, seen)  # type: ignore[arg-type]
    window.offer(world, 1, seen)  # type: ignore[arg-type]
    _until(lambda: made, poll)
    window.offer(world, 1, seen)  # type: ignore[arg-type]
    window.close()
    poll()
    assert len(made) == 1 and base64.b64decode(made[0].png).startswith(PNG) and not made[0].why


def test_what_cannot_be_rendered_is_said_once(monkeypatch: pytest.MonkeyPatch) -> None:
    from chauffeur.concept import MissingExtraError

    def broken(*_: object) -> object:
        raise MissingExtraError("The camera needs a renderer.", hint="pip install 'chauffeur[camera]'")

    monkeypatch.setattr(seat_view, "SeatCamera", broken)
    world, seen = _seen()
    window, made = SeatWindow(), list[SeatView]()
    window.offer(world, 1, seen)  # type: ignore[arg-type]
    _until(lambda: made or ((view := window.news()) and made.append(view)))
    from dataclasses import replace

    window.offer(world, 1, replace(seen, time_s=seen.time_s + 5.0))  # type: ignore[arg-type]
    window.close()
    assert window.news() is None and not made[0].png and "needs a renderer" in made[0].why


def test_a_live_drive_is_planned_from_pictures_and_shown_while_somebody_looks() -> None:
    said: list[Said] = []
    place = find("left-lane")
    starts = tuple(Start(place, place.seed + number, most_s=600.0) for number in range(40))
    with Talk(Settings(starts, planner="vlm", realtime=False), said.append) as talk:
        talk.take(Say("Gently, please."))
        found = lambda: [one for one in said if isinstance(one, Conversation) and one.thoughts]  # noqa: E731
        _until(found, talk.poll)
        assert "cannot see" not in found()[-1].thoughts and "camera" in found()[-1].thoughts
        assert not any(isinstance(one, SeatView) for one in said), "nobody looks"
        talk.take(ShowSeat(True))
        _until(lambda: sum(isinstance(one, SeatView) and bool(one.png) for one in said) >= 2, talk.poll)
        talk.take(ShowSeat(False))
        talk.poll()
        before = len([one for one in said if isinstance(one, SeatView)])
        for _ in range(50):
            talk.poll()
            time.sleep(0.005)
        assert len([one for one in said if isinstance(one, SeatView)]) == before
        talk.abort()
