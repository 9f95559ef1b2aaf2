"""The page: complete in itself, and whatever a person or a model wrote stays text."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sample_trips import HOSTILE, doubted, guarded, highway_trip, intersection_trip, refused_trip

from chauffeur.concept import DataError, Parameters, ParkingLot, ParkingSpot, Program, RoadGraph
from chauffeur.concept.utterance import Act, ActPlace, Condition, Reference
from chauffeur.driving.recording import RecordedTrip
from chauffeur.geometry.route import Route
from chauffeur.hmi.page import embed_json, render_page, write_page


class Reader(HTMLParser):
    """Collects what a browser would make of a page: elements with attributes, and the text of scripts and styles."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.raw: dict[str, list[str]] = {"script": [], "style": [], "title": [], "bdi": []}
        self._inside = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        self._inside = tag
        if tag in self.raw:
            self.raw[tag].append("")

    def handle_endtag(self, tag: str) -> None:
        self._inside = ""

    def handle_data(self, data: str) -> None:
        if self._inside in self.raw:
            self.raw[self._inside][-1] += data

    @property
    def tags(self) -> list[str]:
        return [tag for tag, _ in self.elements]


def payload_of(text: str) -> dict[str, object]:
    return json.loads(Reader(text).raw["script"][0])


@pytest.fixture(scope="module")
def highway_page() -> str:
    return render_page(highway_trip())


def places_shown(trip: RecordedTrip) -> dict[str, bool]:
    drive: Any = payload_of(render_page(trip))["drive"]
    return {place["n"]: place["to"] for place in drive["places"]}


def test_the_places_of_a_town_are_shown_and_which_of_them_is_driven_to() -> None:
    """Where the town is not on this machine the page is made all the same."""
    trip = intersection_trip()
    plan = replace(trip.trip.plan, policy=Parameters(10.0, 12.0, 2.0, 0, "bakery"))
    driven = replace(trip, trip=replace(trip.trip, plan=plan))
    shown = places_shown(replace(driven, scenario=replace(trip.scenario, config={"town": "Gridford"})))
    assert shown["Miller's Bakery"]
    assert sum(shown.values()) == 1 < len(shown)
    assert places_shown(replace(driven, scenario=replace(trip.scenario, config={"town": "Atlantis"}))) == {}
    assert places_shown(trip) == {}


def test_it_asks_for_nothing_from_outside(highway_page: str) -> None:
    reader = Reader(highway_page)
    for tag, attributes in reader.elements:
        assert "src" not in attributes, f"<{tag}> loads something"
        assert not (attributes.get("href") or "#").startswith(("http", "//", "data:", "file:"))
        assert tag not in {"link", "iframe", "object", "embed", "base", "form"}
    style = "".join(reader.raw["style"])
    assert "url(" not in style
    assert "@import" not in style
    script = reader.raw["script"][1]
    assert not re.search(r"fetch\(|XMLHttpRequest|WebSocket|EventSource|sendBeacon|import\(|importScripts", script)
    outside = set(re.findall(r"https?://[^\s\"'`]+", highway_page))
    assert outside <= {"http://www.w3.org/2000/svg"}, "a namespace is a name, nothing else may be an address"


def test_its_policy_admits_its_own_style_and_script_and_nothing_else(highway_page: str) -> None:
    reader = Reader(highway_page)
    policy = next(a["content"] for t, a in reader.elements if t == "meta" and a.get("http-equiv")) or ""
    assert policy.startswith("default-src 'none'")
    for text in (reader.raw["script"][1], reader.raw["style"][0]):
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        assert f"'sha256-{digest}'" in policy
    assert "unsafe" not in policy
    for _, attributes in reader.elements:
        assert "style" not in attributes, "the policy would block it"
        assert not any(name.startswith("on") for name in attributes)


def test_the_script_never_makes_markup_of_text(highway_page: str) -> None:
    script = Reader(highway_page).raw["script"][1]
    for door in ("innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval(", "new Function"):
        assert door not in script


def test_hostile_words_are_inert_everywhere() -> None:
    trip = highway_trip(wish=HOSTILE, seconds=2.0, said=((0.0, HOSTILE),), record=((HOSTILE, HOSTILE),))
    text = render_page(trip)
    reader = Reader(text)
    assert reader.tags == Reader(render_page(highway_trip(seconds=2.0))).tags, "the words made or ate an element"
    assert payload_of(text)["wish"] == HOSTILE
    assert reader.raw["bdi"] == [HOSTILE]
    assert HOSTILE in reader.raw["title"][0]
    assert "<img" not in text


@given(st.text())
@settings(max_examples=200, deadline=None)
def test_embedded_json_gives_back_any_text_and_cannot_leave_its_element(text: str) -> None:
    embedded = embed_json({"wish": text})
    assert json.loads(embedded)["wish"] == text.encode("utf-8", "replace").decode()
    assert not set("<>&\u2028\u2029") & set(embedded)


def test_slots_in_words_are_not_filled() -> None:
    page = render_page(highway_trip(wish="{{data}} {{script}}", seconds=1.0))
    assert Reader(page).raw["bdi"] == ["{{data}} {{script}}"]


@pytest.mark.parametrize(("make", "along"), [(highway_trip, True), (intersection_trip, False)])
def test_both_roads_are_played(make: object, along: bool) -> None:
    trip = make()  # type: ignore[operator]
    drive = payload_of(render_page(trip))["drive"]
    assert isinstance(drive, dict)
    assert drive["camera"]["along"] is along
    assert drive["road"]["surfaces"]
    count = len(trip.frames)
    for column in ("time", "speed", "target", "limit", "gap", "line", "state", "calls", "lane", "goal"):
        assert len(drive[column]) == count, column
    assert len(drive["ego"]["x"]) == count


def test_cones_and_crosswalks_are_on_the_page() -> None:
    trip = highway_trip(seconds=1.0)
    first = trip.frames[0].observation
    cone = replace(first.ego, id=100, kind="static", x_m=first.ego.x_m + 20.0, length_m=0.5, width_m=0.5)
    road = RoadGraph((*first.road.lanes, replace(first.road.lanes[0], id="over:0", kind="crossing")))
    frames = tuple(
        replace(one, observation=replace(one.observation, objects=(cone,), road=road)) for one in trip.frames
    )
    drive = payload_of(render_page(replace(trip, frames=frames)))["drive"]
    assert isinstance(drive, dict)
    assert [one["l"] for one in drive["cones"]] == [0.5]
    assert drive["obstacles"] == []
    assert drive["road"]["bars"]["p"]


def test_what_a_person_needs_to_see_is_there(highway_page: str) -> None:
    payload = payload_of(highway_page)
    assert payload["intent"] == "overtake.left"
    assert ["target speed", "33.0 m/s (119 km/h)"] in payload["settings"]  # type: ignore[operator]
    assert payload["outcome"]["account"] == "; I understood: pass on the left; done."  # type: ignore[index]
    assert [v["passed"] for v in payload["verdicts"]] == [True, False, True]  # type: ignore[attr-defined]
    values = [m["value"] for m in payload["metrics"]]  # type: ignore[attr-defined]
    assert values == ["89.4 points", "91.2 points", "66.7 points", "85.3 points", "does not apply"]
    names = [name for name, _ in payload["provenance"]]  # type: ignore[attr-defined]
    assert {"planner", "model", "seed", "engine", "limits"} <= set(names)
    assert "Simulated drive (highway-env physics)" in highway_page


def test_what_the_shield_did_is_on_the_page_and_nothing_when_it_did_nothing(highway_page: str) -> None:
    shield = payload_of(render_page(guarded(highway_trip(seconds=10.0))))["shield"]
    assert isinstance(shield, dict)
    assert shield["summary"] == "The shield changed a command 15 times: lane not free 10, distance ahead 5."
    first, _, last = shield["stretches"]
    assert (first["t"], first["end"], first["name"]) == (5.0, 6.0, "lane not free")
    assert "→" in last["change"] and "Too close" in last["reason"]
    assert payload_of(highway_page)["shield"] is None
    hidden = {a.get("id") for _, a in Reader(highway_page).elements if "hidden" in a}
    assert {"shield", "spans", "doubts"} <= hidden, "shown by the script where there is something to show"


def test_an_explanation_that_does_not_fit_is_told_on_the_page(highway_page: str) -> None:
    payload = payload_of(render_page(doubted(highway_trip(seconds=2.0))))
    assert payload["mismatches"] == [
        {
            "kind": "missing condition",
            "said": "The left lane is open; I pass and keep a headway of 1.5 s.",
            "instead": "it never asks",
            "line": 10,
        },
        {"kind": "done but not claimed", "said": "", "instead": "it drives faster", "line": 6},
    ]
    told = payload["verdicts"][2]  # type: ignore[index]
    assert (told["passed"], told["vetoes"]) == (False, False)
    assert told["reason"] == "The explanation does not fit the program (score 0.25 of 1, 3 claims compared)."
    assert payload_of(highway_page)["mismatches"] == []


def test_a_refused_wish_has_a_page_too() -> None:
    payload = payload_of(render_page(refused_trip()))
    assert payload["drive"] is None
    assert payload["outcome"]["account"] == "; I declined: There is a wall."  # type: ignore[index]


def test_a_page_of_half_a_minute_is_below_two_megabytes() -> None:
    assert len(render_page(highway_trip(seconds=30.0)).encode()) < 2_000_000


def test_writing_leaves_a_whole_file_or_none(tmp_path: Path) -> None:
    trip = highway_trip(seconds=1.0)
    path = write_page(tmp_path / "deep" / "trip.html", trip)
    assert path.read_text(encoding="utf-8") == render_page(trip)
    assert [p.name for p in path.parent.iterdir()] == ["trip.html"]
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(DataError, match="cannot be written"):
        write_page(tmp_path / "file" / "trip.html", trip)


def test_a_map_shows_the_way_the_spot_and_whom_the_words_meant() -> None:
    silver, bus = Reference("car", colour="silver"), Reference("bus")
    acts = (Act("stop", place=ActPlace("behind", silver)), Act("wait", when=Condition("until", "passed", bus)))
    trip = highway_trip(seconds=1.0)

    def drive_of(policy: Any, acts: tuple[Act, ...]) -> Any:
        plan = replace(trip.trip.plan, policy=policy, acts=acts)
        return payload_of(render_page(replace(trip, trip=replace(trip.trip, plan=plan))))["drive"]

    named = Program("def f():\n    yield from stand_behind(agent(7))\n    yield from wait_for(agent(9))\n")
    assert drive_of(named, acts)["meant"] == {"7": "the silver car", "9": "the bus"}
    assert drive_of(named, acts[:1])["meant"] == {"7": "meant", "9": "meant"}, "which is which is not known"
    front = trip.frames[0].observation.front
    assert front is not None
    ahead = drive_of(Program("def f():\n    yield autopilot()\n"), (Act("pass", target=Reference("car")),))
    assert ahead["meant"] == {str(front.vehicle): "the car"}
    assert "way" not in ahead and "ghost" not in ahead

    first = trip.frames[0].observation
    route = Route(("a-b:1",), 150.0, 400.0)
    frames = tuple(replace(one, observation=replace(one.observation, route=route)) for one in trip.frames)
    spot = ParkingSpot("B4", 200.0, 10.0, 0.0, free=True)
    lot = replace(first, route=route, lot=ParkingLot((spot,), (("exit", 180.0, 0.0),)))
    frames = (replace(frames[0], observation=lot), *frames[1:])
    plan = replace(trip.trip.plan, policy=Parameters(10.0, 12.0, 2.0, 0, "B4"), acts=())
    drive: Any = payload_of(render_page(replace(trip, frames=frames, trip=replace(trip.trip, plan=plan))))["drive"]
    assert drive["to_go"][0] == pytest.approx(250.0)
    assert drive["to_go"] == sorted(drive["to_go"], reverse=True) and drive["to_go"][-1] < drive["to_go"][0] - 15.0
    assert drive["way"][0][:2] == [150.0, 4.0]
    assert (drive["ghost"]["n"], drive["ghost"]["x"], drive["ghost"]["y"]) == ("B4", 200.0, -10.0)
    assert [place["n"] for place in drive["places"]] == ["exit"]
