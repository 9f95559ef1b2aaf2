"""The strip of pictures: right size, right instants, the ego in every picture."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from PIL import Image
from sample_trips import HOSTILE, guarded, highway_trip, intersection_trip, refused_trip

from chauffeur.concept import DataError
from chauffeur.hmi.events import TripMark
from chauffeur.hmi.filmstrip import choose_moments, render_filmstrip, write_filmstrip, write_moving_picture

EGO = (255, 178, 36)
"""Amber, and nothing but the ego is amber."""


RING = (203, 185, 255)
"""Colour of the ring around the ego."""


def colours(image: Image.Image) -> set[tuple[int, int, int]]:
    """Every colour in an image."""
    return {colour for _, colour in image.getcolors(1 << 24) or ()}  # type: ignore[misc]


def ego_rows(image: Image.Image) -> int:
    """How many separate stretches of pixel rows show the ego."""
    width, height = image.size
    pixels = image.load()
    assert pixels is not None
    hits = [any(pixels[x, y] == EGO for x in range(width)) for y in range(height)]
    return sum(hit and not before for before, hit in zip([False, *hits], hits, strict=False))


@pytest.mark.parametrize("make", [highway_trip, intersection_trip])
def test_both_roads_are_drawn_at_readme_width(make: object, tmp_path: Path) -> None:
    path = write_filmstrip(tmp_path / "trip.png", make())  # type: ignore[operator]
    with Image.open(path) as image:
        assert image.format == "PNG"
        assert image.width == 1600
    assert path.stat().st_size < 1_000_000
    assert [p.name for p in tmp_path.iterdir()] == ["trip.png"]


def test_the_ego_is_in_every_picture_of_a_highway() -> None:
    # A window splits the car's paint in rows at most; six pictures stand apart.
    assert ego_rows(render_filmstrip(highway_trip(seconds=6.0), 4)) >= 4


@pytest.mark.parametrize("count", [1, 2, 5])
def test_fewer_pictures_make_a_lower_strip(count: int) -> None:
    trip = highway_trip(seconds=3.0)
    assert render_filmstrip(trip, count).height < render_filmstrip(trip, count + 1).height


def test_instants_go_to_what_happened() -> None:
    times = [t / 10 for t in range(101)]
    events = (TripMark(4.4, "said", "hello"), TripMark(5.5, "lane_change", "left"), TripMark(0.3, "said", "early"))
    moments = choose_moments(times, events, 5)
    assert [times[m.index] for m in moments] == [0.0, 2.5, 5.5, 7.5, 10.0]
    assert [m.event.label if m.event else "" for m in moments] == ["", "", "left", "", ""]


def test_more_pictures_than_instants_gives_each_instant_once() -> None:
    assert [m.index for m in choose_moments([0.0, 0.1], (), 6)] == [0, 1]


@pytest.mark.parametrize("wish", [HOSTILE, "x" * 3000, "走快一点", "", "two\nlines"])
def test_any_wish_can_be_a_caption(wish: str) -> None:
    assert render_filmstrip(highway_trip(wish=wish, seconds=1.0, cars=3), 2).width == 1600


def test_the_shield_is_seen_where_it_acts_and_nowhere_else() -> None:
    plain = highway_trip(seconds=10.0)
    without, acted = render_filmstrip(plain, 5), render_filmstrip(guarded(plain), 5)
    assert acted.height > without.height, "a line of the heading says what it did"
    assert RING not in colours(without)
    assert RING in colours(acted)
    later = [f if f.observation.time_s > 8.0 else replace(f, interventions=()) for f in guarded(plain).frames]
    assert RING not in colours(render_filmstrip(replace(plain, frames=tuple(later)), 2)), "neither picture is then"


def test_nothing_driven_has_no_strip(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="Nothing was driven"):
        write_filmstrip(tmp_path / "trip.png", refused_trip())


def test_a_moving_picture_plays_the_drive_at_its_pace(tmp_path: Path) -> None:
    trip = highway_trip()
    trip = replace(trip, frames=trip.frames[:8])
    path = write_moving_picture(tmp_path / "trip.webp", trip, width=400)
    with Image.open(path) as picture:
        shown: list[int] = []
        for index in range(picture.n_frames):  # type: ignore[attr-defined]
            picture.seek(index)
            picture.load()
            shown.append(picture.info["duration"])
        assert picture.width == 400
    times = [frame.observation.time_s for frame in trip.frames]
    *moving, held = shown
    assert len(moving) >= 4 and held > 1000
    assert sum(moving) / 1000.0 >= times[-1] - times[0] - 0.1
    with pytest.raises(DataError, match="Nothing was driven"):
        write_moving_picture(tmp_path / "none.webp", refused_trip())
