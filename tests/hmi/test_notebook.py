"""What a notebook shows of a drive and of a run."""

from __future__ import annotations

import html
import re
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import chauffeur
from chauffeur.bench.notebook import Rows
from chauffeur.concept import MissingExtraError, PersonId
from chauffeur.driving.session import parse_wish
from chauffeur.hmi import notebook
from chauffeur.hmi.notebook import Drive
from chauffeur.hmi.page import render_page


@pytest.fixture(scope="module")
def drive() -> Drive:
    return chauffeur.drive("Change to the left lane.", scenario="cruise")


@pytest.mark.parametrize("wish", ["It's Ada's & my wish.", "a" * 2000, "\ud800" * 400, '<b>"quoted"</b>'])
def test_it_prints_one_short_line(drive: Drive, wish: str) -> None:
    trip = replace(drive.trip, instruction=parse_wish(wish, PersonId("")))
    for text in (repr(replace(drive, trip=trip)), repr(trip)):
        assert len(text) < 200 and "\n" not in text
        assert wish[:3] in text or "\\ud800" in text
        assert " in cruise, " in text and "onboard" in text


def test_the_player_stands_in_a_frame_of_its_own(drive: Drive) -> None:
    trip = replace(drive.trip, instruction=parse_wish("It's <i>Ada's</i> & \"mine\".", PersonId("")))
    shown = replace(drive, trip=trip)
    (frame,) = re.findall(r"<iframe sandbox=\"allow-scripts\" [^>]*? srcdoc='([^']*)'></iframe>", shown._repr_html_())
    assert html.unescape(frame.replace("&amp;", "&").replace("&#x27;", "'")) == html.unescape(render_page(shown))
    assert 'id="trip-data"' in frame and len(shown._repr_html_()) < 500_000


def test_a_drive_too_long_to_play_is_told(drive: Drive, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(notebook, "MAX_HTML_CHARACTERS", 1000)
    assert "chauffeur show page" in drive._repr_html_() and len(drive._repr_html_()) < 1000


def test_columns_have_a_value_a_period(drive: Drive) -> None:
    columns = drive.columns()
    assert {len(values) for values in columns.values()} == {len(drive.frames)}
    assert columns["time_s"][:3] == pytest.approx([0.0, 0.1, 0.2])
    assert columns["speed_mps"][5] == drive.frames[5].observation.ego.speed_mps
    gaps = [None if one.observation.front is None else one.observation.front.distance_m for one in drive.frames]
    assert columns["gap_m"] == gaps
    units = ("_s", "_m", "_mps", "_mps2", "_rad")
    assert all(name.endswith(units) for name, values in columns.items() if isinstance(values[0], float))


def test_a_declined_wish_is_shown_too() -> None:
    declined = chauffeur.drive("Drive at 300 km/h through the red light.", scenario="cruise")
    assert not declined.frames and set(map(len, declined.columns().values())) == {0}
    assert "<iframe" in declined._repr_html_() and " 0.0 s>" in repr(declined)


def test_frames_of_a_drive_and_of_a_run(drive: Drive, tmp_path: Path) -> None:
    pytest.importorskip("pandas")
    table = drive.frame()
    assert list(table.columns) == list(drive.columns()) and len(table) == len(drive.frames)
    rows = Rows([{"item": "a", "plan": {"intent": "stop"}}, {"item": "b", "plan": {"intent": "go"}}], tmp_path)
    assert list(rows.frame()["plan.intent"]) == ["stop", "go"]


def test_a_plot_has_speed_set_point_and_gap(drive: Drive) -> None:
    pytest.importorskip("matplotlib").use("agg")
    speed, gap = drive.plot()
    assert [line.get_label() for line in speed.lines] == ["speed", "set-point"] and len(gap.lines) == 1
    assert list(speed.lines[0].get_ydata()) == drive.columns()["speed_mps"]
    speed.figure.canvas.draw()


def test_what_is_not_installed_is_named_with_its_remedy(
    drive: Drive, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)
    for ask, library in ((drive.frame, "pandas"), (drive.plot, "matplotlib"), (Rows([], tmp_path).frame, "pandas")):
        with pytest.raises(MissingExtraError, match=rf"needs {library}\..*\[notebook\]"):
            ask()
