"""The viewer in a real Chromium: filtered, opened, compared, by keys, on a phone, in the dark, and from a file."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest
from viewer_folders import content_of, ids_of, make_folders

from chauffeur.bench.viewer.page import write_view
from chauffeur.bench.viewer.server import Viewer
from chromium import CHROMIUM, PHONE, Tab, browser
from small_run import COMMANDS

pytestmark = [
    pytest.mark.slow,
    pytest.mark.server,
    pytest.mark.skipif(not CHROMIUM, reason="no Chromium here"),
]

DESK = (1280, 800)
COUNT = "document.querySelector('.samples .count').textContent"


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_folders(tmp_path_factory.mktemp("viewer"))


def look(root: Path, profile: Path, check: Callable[[Tab, str, dict[str, str]], Awaitable[None]]) -> None:
    """Look at a served viewer; nothing may be complained about in the browser's console."""

    async def run() -> None:
        content = content_of(root / "runs", root / "trips")
        viewer = Viewer(content)
        async with viewer.serving(), browser(profile) as tab:
            await check(tab, viewer.url, ids_of(content))
            assert tab.troubles == []

    asyncio.run(run())


async def samples(tab: Tab, url: str, key: str, size: tuple[int, int] = DESK, scheme: str = "light") -> None:
    """The samples of runs."""
    await tab.open(f"{url}#/runs/{key}", size, scheme=scheme)
    await tab.until("document.querySelector('[data-tab=samples]')")
    await tab.value("document.querySelector('[data-tab=samples]').click()")
    await tab.until("document.querySelector('.row')")


async def choose(tab: Tab, label: str, value: str) -> None:
    """Choose in the field with a label."""
    await tab.value(
        f"""(() => {{ const fields = [...document.querySelectorAll('.field')];
        const select = fields.find((one) => one.textContent.startsWith('{label}')).querySelector('select');
        select.value = '{value}'; select.dispatchEvent(new Event('change')); }})()"""
    )


def test_rows_are_searched_filtered_sorted_and_opened_by_keys_alone(root: Path, tmp_path: Path) -> None:
    async def check(tab: Tab, url: str, ids: dict[str, str]) -> None:
        await samples(tab, url, ids["recorded"])
        assert await tab.value(COUNT) == "10 of 10 samples"
        await tab.press("/")
        await tab.type("say no")
        await tab.until(f"{COUNT} === '2 of 10 samples'")
        await tab.press("Escape")
        assert await tab.value("document.activeElement.id") == "rows"
        await tab.press("ArrowDown", "Enter")
        await tab.until("location.hash.split('/').length === 4")
        await tab.until(f"document.querySelector('h1').textContent === '{COMMANDS[4]}'")
        assert "Nothing was driven." in await tab.value("document.querySelector('.transcript').textContent")
        await tab.press("ArrowLeft")
        await tab.until("document.querySelector('.steps .count').textContent === '1 of 2'")
        await tab.press("Escape")
        await tab.until(f"document.querySelector('.samples') && {COUNT} === '2 of 10 samples'")
        await tab.click(".above .plain")
        await choose(tab, "Judged", "wrong")
        await tab.until("document.querySelector('.row')")
        assert await tab.value("[...document.querySelectorAll('.row .ending')].every((one) => one.matches('.bad'))")
        await choose(tab, "Judged", "")
        await choose(tab, "Cause", "refused")
        await tab.until(f"{COUNT} === '2 of 10 samples'")
        await choose(tab, "Cause", "")
        await choose(tab, "Column", "steps")
        await choose(tab, "Sort by", "steps")
        values = await tab.value("[...document.querySelectorAll('.row .extra')].map((one) => Number(one.textContent))")
        assert values == sorted(values) and len(set(values)) > 1

    look(root, tmp_path, check)


def test_a_sample_has_its_drive_beside_it(root: Path, tmp_path: Path) -> None:
    async def check(tab: Tab, url: str, ids: dict[str, str]) -> None:
        await tab.open(f"{url}#/runs/{ids['recorded']}/0", DESK)
        await tab.until("document.querySelector('.drive iframe')")
        assert await tab.value("document.querySelector('iframe').getAttribute('sandbox')") == "allow-scripts"
        assert await tab.value("document.querySelector('.code li code').textContent") == "def change():"
        left, right = await tab.value(
            "['.said-card', '.drive'].map((one) => document.querySelector(one).getBoundingClientRect().left)"
        )
        assert left < right
        await tab.open(f"{url}#/trip/{ids['overtake']}", DESK)
        await tab.until("document.querySelector('.drive.whole iframe')")

    look(root, tmp_path, check)


def test_two_runs_are_chosen_and_compared(root: Path, tmp_path: Path) -> None:
    async def check(tab: Tab, url: str, ids: dict[str, str]) -> None:
        await tab.open(url, DESK)
        await tab.until("document.querySelectorAll('.pick input').length === 3")
        for name in ("recorded", "mobil"):
            box = f"[...document.querySelectorAll('.pick input')].find((one) => one.ariaLabel.includes('/{name} '))"
            await tab.value(f"{box}.click()")
        await tab.until("document.querySelector('#chosen a')")
        await tab.value("document.querySelector('#chosen a').click()")
        await tab.until("document.querySelector('[data-tab=samples]')")
        await tab.value("document.querySelector('[data-tab=samples]').click()")
        await tab.until("document.querySelectorAll('.row .ending').length === 20")
        await choose(tab, "Differs", "right")
        await tab.until("document.querySelector('.row')")
        pairs = await tab.value(
            "[...document.querySelectorAll('.row')]"
            ".map((row) => [...row.querySelectorAll('.ending')].map((one) => one.className))"
        )
        assert pairs and all(one != other for one, other in pairs)
        await tab.press("Tab")
        await tab.value("document.getElementById('rows').focus()")
        await tab.press("Enter")
        await tab.until("document.querySelectorAll('.beside .said-card').length === 2")

    look(root, tmp_path, check)


@pytest.mark.parametrize(("size", "scheme"), [(DESK, "light"), (DESK, "dark"), (PHONE, "light"), (PHONE, "dark")])
def test_every_screen_can_be_read(root: Path, tmp_path: Path, size: tuple[int, int], scheme: str) -> None:
    async def check(tab: Tab, url: str, ids: dict[str, str]) -> None:
        both = f"{ids['recorded']}+{ids['mobil']}"
        screens = {
            "#/": ".index",
            f"#/runs/{ids['recorded']}": "#panel table",
            f"#/runs/{both}/0.0": ".beside .transcript",
            f"#/runs/{ids['faithfulness']}/0": ".transcript",
        }
        for at, wanted in screens.items():
            await tab.open(url + at, size, scheme=scheme)
            await tab.until(f"document.querySelector('{wanted}')")
            assert await tab.value("document.documentElement.scrollWidth <= innerWidth"), at
            assert await tab.value("document.getElementById('trouble').hidden"), at
            light = await tab.value("getComputedStyle(document.body).backgroundColor")
            assert (sum(map(int, light[4:-1].split(","))) < 3 * 128) is (scheme == "dark")
        await samples(tab, url, both, size, scheme)
        assert await tab.value("document.documentElement.scrollWidth <= innerWidth")

    look(root, tmp_path, check)


def test_an_exported_page_works_from_the_disk(root: Path, tmp_path: Path) -> None:
    content = content_of(root / "runs")
    ids = ids_of(content)
    page = write_view(tmp_path / "page.html", content, [ids["recorded"], ids["mobil"]], [], 12)

    async def run() -> None:
        async with browser(tmp_path / "profile") as tab:
            both = f"{ids['recorded']}+{ids['mobil']}"
            await samples(tab, page.as_uri(), both)
            assert await tab.value(COUNT) == "10 of 10 samples"
            await tab.open(page.as_uri(), DESK)
            await tab.until(f"location.hash.endsWith('{both}') || document.querySelector('#panel table')")
            name = ids["recorded"]
            place = next(one for one in content.chosen(name, 12) if content.sample(name, one)["drivable"])
            await tab.open(f"{page.as_uri()}#/runs/{name}/{place}", DESK)
            await tab.until("document.querySelector('.drive iframe')")
            assert tab.troubles == []

    asyncio.run(run())
