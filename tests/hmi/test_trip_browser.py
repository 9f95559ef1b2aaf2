"""The trip page in a real Chromium: played, by keys alone, on a phone, in the dark, and read aloud."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Coroutine, Iterator
from contextlib import AsyncExitStack
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from sample_trips import doubted, guarded, highway_trip, intersection_trip, refused_trip

from chauffeur.hmi.page import write_page
from chromium import CHROMIUM, PHONE, Tab, browser

pytestmark = [pytest.mark.slow, pytest.mark.server]

DESK = (1280, 800)
TRIPS = {
    "highway": guarded(doubted(highway_trip(seconds=10.0))),
    "crossing": intersection_trip(),
    "declined": refused_trip(),
}


class Pages:
    """A tab, and the pages of trips to open in it."""

    def __init__(self, tab: Tab, runner: asyncio.Runner, folder: Path) -> None:
        self.tab, self._runner = tab, runner
        self._paths = {name: write_page(folder / f"{name}.html", trip) for name, trip in TRIPS.items()}

    def run(self, check: Coroutine[Any, Any, None]) -> None:
        self._runner.run(check)

    async def open(self, name: str, size: tuple[int, int] = DESK, at: str = "#t=3", **prefers: Any) -> None:
        """A page, paused at an instant; its console has to stay silent."""
        await self.tab.open(f"{self._paths[name].as_uri()}{at}", size, **prefers)
        assert self.tab.troubles == []

    async def text(self, selector: str) -> str:
        return await self.tab.value(f"document.querySelector({json.dumps(selector)}).innerText")

    async def time_s(self) -> float:
        return float((await self.text("#clock")).removesuffix(" s"))


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Pages]:
    if not CHROMIUM:
        pytest.skip("no Chromium here")
    folder = tmp_path_factory.mktemp("trips")
    with asyncio.Runner() as runner:
        stack = AsyncExitStack()
        tab = runner.run(stack.enter_async_context(browser(folder / "profile")))
        try:
            yield Pages(tab, runner, folder)
        finally:
            runner.run(stack.aclose())


def test_it_plays_to_the_end_and_begins_anew(pages: Pages) -> None:
    async def check() -> None:
        await pages.open("highway", at="")
        await pages.tab.until("document.getElementById('play').ariaLabel === 'Pause'")
        await pages.tab.until("parseFloat(document.getElementById('clock').textContent) > 0.3")
        await pages.tab.press("ArrowUp", "ArrowUp", "ArrowUp")
        assert await pages.tab.value("document.querySelector('#rate input:checked').value") == "8"
        await pages.tab.until("document.getElementById('play').ariaLabel === 'Play'")
        assert await pages.time_s() == pytest.approx(9.9)
        await pages.tab.click("#play")
        await pages.tab.until("document.getElementById('play').ariaLabel === 'Pause'")
        assert pages.tab.troubles == []

    pages.run(check())


def test_every_instant_is_reached_by_keys(pages: Pages) -> None:
    async def check() -> None:
        await pages.open("highway")
        await pages.tab.press("ArrowRight", "ArrowRight")
        assert await pages.time_s() == pytest.approx(3.2)
        await pages.tab.press("ArrowLeft", shift=True)
        assert await pages.time_s() == pytest.approx(2.2)
        before = await pages.tab.value("document.getElementById('road').toDataURL()")
        await pages.tab.press("End")
        assert await pages.time_s() == pytest.approx(9.9)
        assert await pages.tab.value("document.getElementById('road').toDataURL()") != before
        await pages.tab.press("Home", " ")
        await pages.tab.until("parseFloat(document.getElementById('clock').textContent) > 0.2")
        await pages.tab.press(" ")
        assert await pages.tab.value("document.getElementById('play').ariaLabel") == "Play"

    pages.run(check())


def test_the_outcome_comes_first_and_engineers_numbers_are_folded(pages: Pages) -> None:
    async def check() -> None:
        await pages.open("highway")
        assert (await pages.text("h1")).endswith("Done, not as explained")
        assert (await pages.text(".account")).startswith("You asked “I'm really in a hurry now.”; ")
        seen = await pages.text("body")
        for word in ("m/s", "alignment-v1", "lampilot", "get_distance_between_vehicles", "onboard-v1"):
            assert word not in seen, word
        await pages.tab.value("document.querySelector('#engineers summary').focus()")
        await pages.tab.press("Enter")
        opened = await pages.text("body")
        for word in ("m/s²", "alignment-v1", "lampilot-score-v1", "get_distance_between_vehicles", "onboard-v1"):
            assert word in opened, word
        assert await pages.tab.value("document.querySelector('#program [aria-current]').dataset.n") == "8"

    pages.run(check())


def test_a_screen_reader_is_told_what_is_seen(pages: Pages) -> None:
    async def check() -> None:
        await pages.open("highway")
        await pages.tab.press("ArrowRight")
        told = await pages.tab.value("document.getElementById('now').textContent")
        assert told.startswith("3.1 s: speed ") and "km/h" in told and "m/s" not in told
        picture = await pages.tab.value("document.getElementById('road').ariaLabel")
        assert "3.1 seconds" in picture and "km/h" in picture
        levels = await pages.tab.value("[...document.querySelectorAll('h1, h2, h3')].map((h) => Number(h.tagName[1]))")
        assert levels[0] == 1 and levels.count(1) == 1
        assert all(after <= before + 1 for before, after in pairwise(levels))
        named = "(e.ariaLabel || e.innerText || e.labels?.length)"
        nameless = f"[...document.querySelectorAll('button, input')].filter((e) => !{named}).length"
        assert await pages.tab.value(nameless) == 0
        await pages.tab.click("#steps li:nth-child(2) button")
        assert await pages.time_s() == pytest.approx(6.0, abs=2.5)

    pages.run(check())


@pytest.mark.parametrize("size", [PHONE, DESK, (768, 760)])
@pytest.mark.parametrize("name", sorted(TRIPS))
def test_nothing_is_wider_than_the_screen(pages: Pages, name: str, size: tuple[int, int]) -> None:
    async def check() -> None:
        await pages.open(name, size)
        await pages.tab.value("document.getElementById('engineers').open = true")
        assert await pages.tab.value("document.documentElement.scrollWidth") <= size[0]
        await pages.tab.value("document.getElementById('engineers').open = false")
        if TRIPS[name].frames:
            bottom = await pages.tab.value("document.getElementById('scrub').getBoundingClientRect().bottom")
            assert bottom <= size[1], "picture and time line are seen without scrolling"

    pages.run(check())


def test_it_is_dark_for_those_who_like_it_dark_and_still_for_those_who_like_it_still(pages: Pages) -> None:
    async def check() -> None:
        total = ".reduce((a, b) => Number(a) + Number(b))"
        back = f"getComputedStyle(document.body).backgroundColor.match(/\\d+/g){total}"
        drawn = "document.getElementById('road').getContext('2d').getImageData(3, 3, 1, 1).data"
        corner = f"[...{drawn}.slice(0, 3)]{total}"
        await pages.open("crossing")
        assert await pages.tab.value(back) > 600 and await pages.tab.value(corner) > 500
        await pages.open("crossing", scheme="dark", calm=True, at="")
        assert await pages.tab.value(back) < 150 and await pages.tab.value(corner) < 200
        assert (
            await pages.time_s() == 0.0 and await pages.tab.value("document.getElementById('play').ariaLabel") == "Play"
        )

    pages.run(check())


def test_a_wish_of_which_nothing_was_driven_has_no_player(pages: Pages) -> None:
    async def check() -> None:
        await pages.open("declined")
        assert await pages.text("h1") == "– Declined"
        assert await pages.text(".account") == "You asked “Drive through the wall.”; I declined: There is a wall."
        assert not await pages.tab.value("document.getElementById('player').checkVisibility()")

    pages.run(check())
