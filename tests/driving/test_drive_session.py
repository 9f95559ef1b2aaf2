"""Every session that one talks with takes words in at the same entrance, and tells whoever subscribes."""

from __future__ import annotations

import pytest

from chauffeur.concept import NOBODY, ConfigError, Instruction, Result
from chauffeur.driving.drive_session import DriveSession, Entrance
from chauffeur.driving.events import DriveEvent
from chauffeur.driving.live.settings import Settings
from chauffeur.driving.live.starts import Start
from chauffeur.driving.onroad.session import VehicleSession
from chauffeur.driving.scenarios import find
from chauffeur.driving.talk.session import Talk
from chauffeur.planners.registry import make_planner
from chauffeur.worlds.ros.factory import open_vehicle
from chauffeur.worlds.ros.settings import parse_settings

FILE = """interface = "rosbridge"
stack = "autoware.ai"
[limits]
max_speed_mps = 10.0
look_ahead_m = [4.0, 10.0]
"""


def talk() -> DriveSession:
    return Talk(Settings((Start(find("overtake"), 3),), planner="keyword"), lambda said: None)


def vehicle() -> DriveSession:
    settings = parse_settings(FILE)
    return VehicleSession(open_vehicle(settings, dry_run=True), settings, make_planner("talk2drive"))


@pytest.fixture(params=[talk, vehicle])
def session(request: pytest.FixtureRequest) -> DriveSession:
    return request.param()


@pytest.mark.parametrize(
    ("words", "way"),
    [
        ("Stop!", "stop"),
        ("oh god there's a child on the road stop stop", "stop"),
        ("Arrête !", "stop"),
        ("I smell smoke.", "distress"),
        ("Don't stop.", "go_on"),
        ("quit", "leave"),
        ("ok, bye!", "leave"),
        ("never mind", "nothing"),
        ("yes", "wish"),
        ("Drive at 20 km/h.", "wish"),
        ("Don't stop at all, drive faster.", "wish"),
    ],
)
def test_words_come_to_the_same_on_every_transport(session: DriveSession, words: str, way: str) -> None:
    assert session.enter(words).way == way


def test_only_words_that_wish_for_something_go_on_without_an_answer(session: DriveSession) -> None:
    for words in ("I smell smoke.", "Don't stop.", "quit", "never mind"):
        assert session.enter(words).words, words
    assert session.enter("Drive at 20 km/h.") == Entrance("wish")


def test_a_question_of_the_car_is_answered_before_anything_but_an_emergency(monkeypatch: pytest.MonkeyPatch) -> None:
    for made in (talk(), vehicle()):
        monkeypatch.setattr(type(made), "_question_is_open", property(lambda _: True))
        assert [made.enter(words).way for words in ("yes", "no", "Stop!")] == ["yes", "no", "stop"]
        assert made.enter("no").result is Result.DECLINED


def test_subscribers_hear_every_event_and_one_that_fails_takes_nothing_with_it(session: DriveSession) -> None:
    heard: list[DriveEvent] = []

    def fails(event: DriveEvent) -> None:
        raise RuntimeError(event.kind)

    session.subscribe(fails)
    session.subscribe(heard.append)
    event = DriveEvent("wish", "w1", "Go.", value=Instruction("Go.", NOBODY))
    session._tell(event)  # pyright: ignore[reportPrivateUsage]
    assert heard == [event]


def test_a_vehicle_gives_no_wheel_to_a_program() -> None:
    with pytest.raises(ConfigError):
        vehicle().take_over(True)
