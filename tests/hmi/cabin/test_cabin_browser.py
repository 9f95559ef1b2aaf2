"""The cabin page in a real Chromium with a real drive behind it: typing, speaking, keys alone, and looking away."""

from __future__ import annotations

import asyncio
import json
from dataclasses import replace
from pathlib import Path

import pytest
from cabin_desk import SAID, SAID_MPS, Desk
from cabin_drive import Drive, driving

from chauffeur.driving.talk.messages import (
    Button,
    Confirm,
    Conversation,
    Ended,
    Evaluate,
    Hand,
    HowWasIt,
    Listening,
    MemoryEntry,
    MemoryOrder,
    MemoryState,
    Note,
    Say,
    SessionState,
    TakeOver,
)
from chauffeur.hmi.cabin import Cabin
from chromium import CHROMIUM, PATIENCE_S, PHONE, TABLET, Tab, browser

pytestmark = [pytest.mark.slow, pytest.mark.server]

AUDIT = (Path(__file__).parent / "audit.js").read_text(encoding="utf-8")
ALOUD = """{
    window.aloud = [];
    const told = document.getElementById('told');
    new MutationObserver(() => window.aloud.push(told.textContent)).observe(told, { childList: true });
}"""
PICTURE = "document.getElementById('road').toDataURL()"


async def text(tab: Tab, name: str) -> str:
    return await tab.value(f"document.getElementById({json.dumps(name)}).textContent")


async def opened(tab: Tab, drive: Drive, size: tuple[int, int] = TABLET, *, calm: bool = False) -> None:
    """The page of a drive, once it shows the road and may be used."""
    await tab.open(drive.url, size, calm=calm)
    await tab.until("document.getElementById('speed').textContent !== '–'")
    await tab.until("!document.getElementById('talk-command').disabled")


def test_a_typed_wish_is_shown_from_thought_to_set_point(desk: Desk, drive: Drive) -> None:
    async def check() -> None:
        tab = desk.tab
        await opened(tab, drive)
        assert await text(tab, "vehicle") == "Simulated drive"
        before = await tab.value(PICTURE)
        await tab.press("/")
        await tab.type("Drive at 60 km/h.")
        await tab.press("Enter")
        await tab.until("document.querySelector('.wish .state.drive')")
        await tab.until("document.querySelector('.code [aria-current=step]')")
        await tab.until("document.getElementById('target').textContent === '60'")
        assert Say("Drive at 60 km/h.") in drive.told and drive.scene.target_mps * 3.6 == pytest.approx(60.0, abs=0.5)
        card = await tab.value("document.querySelector('.wish').innerText")
        for part in ("typed · w1", "Drive at 60 km/h.", "It thinks", "It drives by", "passed: format"):
            assert part in card, part
        await tab.until("document.querySelector('.wish .legend')")
        assert "in all" in await tab.value("document.querySelector('.wish .legend .total').textContent")
        assert await tab.value("document.getElementById('wish').value") == ""
        assert await tab.value(PICTURE) != before
        await tab.until("document.getElementById('scene-words').textContent.startsWith('At ')")
        await tab.click("[data-opinion='That was good.']")
        await tab.until("document.querySelector('.wish').innerText.includes('That was good.')")
        assert "That was good." in [told.text for told in drive.told if isinstance(told, Evaluate)]
        assert not tab.troubles

    desk.run(check())


def test_keys_work_again_once_a_wish_was_sent(desk: Desk, drive: Drive) -> None:
    async def check() -> None:
        tab = desk.tab
        await opened(tab, drive)
        await tab.press("/")
        await tab.type("Drive at 70 km/h.")
        await tab.press("Enter")
        await tab.until("document.activeElement !== document.getElementById('wish')")
        await tab.press("/")
        await tab.until("document.activeElement === document.getElementById('wish')")
        assert await tab.value("document.getElementById('wish').value") == ""

    desk.run(check())


@pytest.mark.parametrize("size", [TABLET, PHONE], ids=["tablet", "phone"])
def test_what_cannot_be_used_is_not_shown(desk: Desk, size: tuple[int, int]) -> None:
    why = "Speech is off: pocketsphinx is not installed."

    async def check() -> None:
        tab = desk.tab
        with Cabin() as cabin:
            cabin.tell(replace(SESSION, engine=""))
            cabin.tell(Listening("off", why=why))
            await tab.open(cabin.url, size)
            await tab.until(f"document.getElementById('heard-words').textContent.includes({json.dumps(why)})")
            assert await tab.value("document.getElementById('talk').hidden")
            assert await tab.value("[...document.querySelectorAll('.spoken')].every((row) => row.hidden)")

    desk.run(check())


SEEN = """(selector) => {
    const box = document.querySelector(selector).getBoundingClientRect();
    return box.width > 0 && box.top >= 0 && box.left >= 0 && box.bottom <= innerHeight && box.right <= innerWidth;
}"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_phone_shows_the_road_the_speed_the_state_and_the_newest_turn_without_scrolling(
    desk: Desk, drive: Drive, scheme: str
) -> None:
    words = f"Drive at {45 if scheme == 'light' else 50} mph."

    async def check() -> None:
        tab = desk.tab
        await opened(tab, drive, PHONE)
        await tab.prefer(scheme=scheme)
        await sent(tab, words)
        await tab.until(f"document.querySelector('.wish .said-words')?.textContent === {json.dumps(words)}")
        await tab.until("document.querySelector('.wish:first-child .state.drive')")
        await tab.until("document.querySelector('.speed .unit').textContent === 'mph'")
        await asyncio.to_thread(drive.until, "the set-point", lambda: drive.scene.wish == drive.wish(words).wish)
        for part in (
            "#road",
            "#speed",
            "#level",
            "#limit",
            ".wish:first-child .state",
            ".wish:first-child .said-words",
        ):
            assert await tab.value(f"({SEEN})({json.dumps(part)})"), part
        for part in ("#wish", "#take-over", "#stop"):
            assert await tab.value(f"({SEEN})({json.dumps(part)})"), part
        whole, high, speed_px = await tab.value(
            "[[document.documentElement.scrollWidth <= innerWidth,"
            " document.documentElement.scrollHeight <= innerHeight], document.getElementById('road').clientHeight,"
            " parseFloat(getComputedStyle(document.getElementById('speed')).fontSize)]"
        )
        assert whole == [True, True] and high >= 180 and speed_px >= 40
        assert (await text(tab, "speed")).isdecimal() and (await text(tab, "limit")).isdecimal()
        assert not await tab.value("document.querySelector('.wish .detail')?.open"), "the engineer's part is folded"
        assert await tab.value(AUDIT) == []
        await sent(tab, "Drive at 85 km/h.")
        await tab.until("document.querySelector('.speed .unit').textContent === 'km/h'")

    desk.run(check())


@pytest.mark.parametrize("size", [TABLET, PHONE], ids=["tablet", "phone"])
def test_everything_can_be_read_and_reached(desk: Desk, drive: Drive, size: tuple[int, int]) -> None:
    async def check() -> None:
        tab = desk.tab
        await opened(tab, drive, size)
        for scheme in ("light", "dark"):
            await tab.prefer(scheme=scheme)
            for name in ("memory", "about", "conversation"):
                await tab.click(f"#tab-{name}")
                assert await tab.value(AUDIT) == [], f"{scheme}, {name}"

    desk.run(check())


def test_speaking_into_the_browser_changes_the_set_point(desk: Desk, drive: Drive) -> None:
    if not desk.said_bytes:
        pytest.skip("no synthetic voice here: neither flite nor espeak-ng")

    async def check() -> None:
        tab = desk.tab
        await opened(tab, drive)
        assert drive.sound_bytes == 0, "nothing is recorded before a button is held"
        heard = ""
        async with asyncio.timeout(PATIENCE_S):
            while heard != SAID:  # on a starved machine the browser's sound has gaps: then it is said again
                known, so_far = len(drive.said("heard")), drive.sound_bytes
                await tab.finger("mousePressed", "#talk-command")
                while drive.sound_bytes < so_far + desk.said_bytes:
                    await asyncio.sleep(0.02)
                await tab.finger("mouseReleased", "#talk-command")
                await asyncio.to_thread(drive.until, "words", lambda known=known: len(drive.said("heard")) > known)
                heard = drive.said("heard")[-1].text
        await tab.until("!document.getElementById('confirm').hidden")
        assert f"“{SAID}”" in await text(tab, "heard-words")
        assert drive.told[-2:] == [Button("command", held=True), Button("command", held=False)]
        sound_bytes, before = drive.sound_bytes, drive.scene.target_mps
        assert before != pytest.approx(SAID_MPS, abs=0.1)
        await tab.press("y")
        await tab.until("document.querySelector('.wish .how')?.innerText.includes('said')")
        wish = drive.wish(SAID)
        await asyncio.to_thread(
            drive.until, "a set-point", lambda: drive.scene.wish == wish.wish and drive.scene.target_mps != before
        )
        assert Confirm(yes=True) in drive.told
        assert wish.spoken
        assert "said · " in await tab.value("document.querySelector('.wish').innerText")
        assert await tab.value("document.getElementById('confirm').hidden")
        assert drive.sound_bytes == sound_bytes, "and nothing after it is let go"

    desk.run(check())


def test_the_keyboard_alone_is_enough(desk: Desk, drive: Drive) -> None:
    async def check() -> None:
        tab = desk.tab
        await opened(tab, drive)
        reached = []
        for _ in range(40):
            await tab.press("Tab")
            name, outline = await tab.value(
                "(({ id, dataset, tagName }) => [id || dataset.opinion || tagName,"
                " getComputedStyle(document.activeElement).outlineStyle])(document.activeElement)"
            )
            assert name == "BODY" or outline == "solid", f"{name} does not show its focus"
            reached.append(name)
        wanted = {"talk-command", "talk-evaluate", "open-microphone", "wish", "as-opinion", "take-over", "stop"}
        assert wanted | {"That was too fast.", "tab-conversation", "conversation"} <= set(reached)
        await tab.press("Escape", "t")
        await tab.until("!document.getElementById('pad').hidden")
        speed_mps = drive.scene.target_mps
        await tab.press("ArrowUp", "ArrowUp", "b", "t")
        await tab.until("document.getElementById('pad').hidden")
        hands = [told for told in drive.told if isinstance(told, Hand | TakeOver)]
        assert hands == [TakeOver(True), Hand("faster"), Hand("faster"), Hand("brake"), TakeOver(False)]
        assert speed_mps is not None
        await tab.value("document.getElementById('tab-conversation').focus()")
        await tab.press("ArrowRight")
        assert await tab.value("document.activeElement.id") == "tab-memory"
        assert "without a name" in await text(tab, "memory")
        await tab.value("document.getElementById('talk-evaluate').focus()")
        await tab.down(" ")
        await tab.until("document.getElementById('talk-evaluate').textContent.includes('Speak now')")
        await tab.up(" ")
        while Button("evaluate", held=False) not in drive.told:
            await asyncio.sleep(0.02)

    desk.run(check())


def test_who_likes_it_calm_sees_one_picture_for_each_instant(desk: Desk, drive: Drive) -> None:
    pictures = f"""new Promise((resolve) => {{
        const seen = new Set();
        const until = performance.now() + 1500;
        const look = () => {{
            seen.add({PICTURE});
            if (performance.now() < until) requestAnimationFrame(look); else resolve(seen.size);
        }};
        look();
    }})"""

    async def check() -> None:
        tab = desk.tab
        await opened(tab, drive, calm=True)
        before = len(drive.said("scene"))
        calm = await tab.value(pictures)
        told = len(drive.said("scene")) - before
        assert 2 <= calm <= told + 2
        await tab.prefer(calm=False)
        before = len(drive.said("scene"))
        smooth = await tab.value(pictures)
        assert smooth > len(drive.said("scene")) - before + 2, "between two instants, everything glides"

    desk.run(check())


def test_a_page_that_is_closed_changes_nothing_for_the_drive(desk: Desk, drive: Drive) -> None:
    async def check() -> None:
        tab = desk.tab
        await opened(tab, drive)
        await tab.press("/")
        await tab.type("Drive at 80 km/h.")
        await tab.press("Enter")
        said = "Drive at 80 km/h."
        await asyncio.to_thread(drive.until, "the wish", lambda: drive.wish(said))
        wish = drive.wish(said).wish
        await asyncio.to_thread(drive.until, "the drive", lambda: drive.scene.wish == wish)
        await tab.ask("Page.navigate", url="about:blank")
        left_s = drive.scene.time_s
        await asyncio.to_thread(drive.until, "another second", lambda: drive.scene.time_s > left_s + 1.0)
        assert drive.wish(said).outcome in ("", "finished") and not drive.scene.taken_over
        await opened(tab, drive)
        await tab.until("document.querySelector('.wish')")
        assert "Drive at 80 km/h." in await tab.value("document.querySelector('.wish').innerText")

    desk.run(check())


async def sent(tab: Tab, words: str) -> None:
    await tab.press("/")
    await tab.type(words)
    await tab.press("Enter")


async def asked(tab: Tab, words: str) -> None:
    """Say something that the planner is unsure of, and wait until the page asks."""
    await tab.value(ALOUD)
    await sent(tab, words)
    await tab.until("document.getElementById('yes').checkVisibility()")
    question = await text(tab, "heard-words")
    assert question.endswith("?") or "Shall I" in question
    await tab.until(f"window.aloud.some((words) => words.includes({json.dumps(question)}))")  # a screen reader is told


def test_every_question_has_a_yes_and_a_no_and_what_runs_goes_on(desk: Desk) -> None:
    """A planner's own question, the one after a question of the person, and the one after distress."""

    async def check(drive: Drive) -> None:
        tab = desk.tab
        await tab.open(drive.url)
        await tab.until("document.getElementById('speed').textContent !== '–'")
        await sent(tab, "Keep 60 m to the car ahead.")
        await asyncio.to_thread(drive.until, "the wish", lambda: drive.scene.wish == "w1")

        answers: list[bool] = []
        for unsure, no in (("Drive at 8O km/h.", "n"), ("Could you drive at 8O km/h?", ""), ("I feel sick.", "n")):
            await asked(tab, unsure)
            if no:
                await tab.press(no)
            else:  # by Tab and Enter, from what has the focus after typing
                await tab.value("document.getElementById('no').focus()")
                await tab.press("Enter")
            await tab.until("document.getElementById('confirm').hidden")
            answers.append(False)
            await asyncio.to_thread(
                drive.until,
                "the no",
                lambda: [told.yes for told in drive.told if isinstance(told, Confirm)] == answers,
            )
            await tab.until("document.getElementById('notes').textContent.includes('Then I do not.')")

        await sent(tab, "Why did you brake?")
        await tab.until("document.querySelector('.wish .state').textContent.includes('Done')")
        assert await tab.value("document.getElementById('confirm').hidden")
        assert drive.scene.wish == "w1", "no question has ended what runs"

        await asked(tab, "Drive at 8O km/h.")
        question = drive.wish("Drive at 8O km/h.").wish
        await tab.click("#yes")
        await asyncio.to_thread(drive.until, "what was offered", lambda: drive.scene.wish not in ("", "w1", question))

        await tab.press("t")
        await tab.until("!document.getElementById('pad').hidden")
        await tab.press("t")
        await tab.until("document.getElementById('pad').hidden")
        assert not tab.troubles
        await sent(tab, "Quit, please!")
        await tab.until("document.getElementById('notes').textContent.includes('You end the session')")
        await tab.until("document.getElementById('link').textContent === 'Drive over'")
        assert drive.said("ended")[-1].outcome == "stopped"
        assert not [each for each in drive.said("conversation") if "Quit" in each.text], "it is no wish"

    with driving("following", planner="onboard") as drive:
        desk.run(check(drive))


def test_a_phone_is_enough_to_answer_and_to_take_the_wheel(desk: Desk) -> None:
    async def check(drive: Drive) -> None:
        tab = desk.tab
        await tab.open(drive.url, PHONE, scheme="dark")
        await tab.until("document.getElementById('speed').textContent !== '–'")
        await asked(tab, "Drive at 8O km/h.")
        for part in ("#yes", "#no", "#heard-words", ".wish .why", "#road", "#speed"):
            assert await tab.value(f"({SEEN})({json.dumps(part)})"), part
        assert await tab.value(AUDIT) == []
        await tab.click("#no")
        await tab.until("document.getElementById('notes').textContent.includes('Then I do not.')")
        await tab.click("#take-over")
        await tab.until("!document.getElementById('pad').hidden")
        assert await tab.value(AUDIT) == [] and "You drive" in await text(tab, "level")
        await tab.click("[data-hand=faster]")
        await asyncio.to_thread(drive.until, "the hand", lambda: Hand("faster") in drive.told)
        await tab.click("#take-over")
        await tab.until("document.getElementById('pad').hidden")
        assert [told.on for told in drive.told if isinstance(told, TakeOver)] == [True, False]
        assert not tab.troubles

    with driving("following", planner="onboard") as drive:
        desk.run(check(drive))


def test_a_drive_through_a_town_shows_where_it_goes_how_far_and_how_long(desk: Desk) -> None:
    pytest.importorskip("libsumo", reason="needs the extra `town`")

    async def check(drive: Drive) -> None:
        tab = desk.tab
        await tab.open(drive.url, PHONE)
        await tab.until("document.getElementById('speed').textContent !== '–'")
        await sent(tab, "Take me to the church.")
        shown = "document.getElementById('level').textContent"
        await tab.until(f"/^To St. Mary's Church, [0-9.]+ k?m, about [0-9]+ (s|min)$/.test({shown})")
        wish = drive.wish("Take me to the church.").wish
        await sent(tab, "Why are we standing?")
        await tab.until("document.querySelector('.wish:first-child .state')?.textContent.includes('Done')")
        assert await tab.value("document.querySelector('.wish:first-child .why').textContent")
        await asyncio.to_thread(drive.until, "the way", lambda: drive.scene.goal is not None and drive.scene.goal.lanes)
        assert drive.scene.wish == wish and drive.scene.goal.left_s > 0.0
        assert not tab.troubles

    with driving("town", planner="onboard") as drive:
        desk.run(check(drive))


def test_the_stop_button_stops_whatever_is_asked(desk: Desk) -> None:
    async def check(drive: Drive) -> None:
        tab = desk.tab
        await tab.open(drive.url)
        await tab.until("document.getElementById('speed').textContent !== '–'")
        await asked(tab, "Drive at 8O km/h.")
        await tab.click("#stop")
        await tab.until("document.getElementById('confirm').hidden")
        await tab.until("document.getElementById('link').textContent === 'Drive over'")
        assert drive.said("ended")[-1].outcome == "stopped"

    with driving("following", planner="onboard", speed=2.0) as drive:
        desk.run(check(drive))


SESSION = SessionState("cruise", "A road", 3, "meaning", "grammar/test", False, "ada", "simulated", 0.1, ("a limit",))
ENTRIES = tuple(MemoryEntry(f"e{i}", "2026-11-21T18:20:00+00:00", f"wish {i}", "driven", "") for i in (2, 1))


async def told(cabin: Cabin) -> object:
    """What the page tells next; the browser goes on meanwhile."""
    return await asyncio.to_thread(cabin.take, 30.0)


def test_memory_is_looked_after_and_erased_only_when_sure(desk: Desk) -> None:
    async def check(cabin: Cabin) -> None:
        tab = desk.tab
        await tab.open(cabin.url)
        cabin.tell(SESSION)
        cabin.tell(MemoryState("ada", False, 90.0, 2, ENTRIES))
        await tab.until("document.getElementById('memory-count').textContent.trim() === '2'")
        assert await tab.value("document.getElementById('private').hidden")
        await tab.click("#tab-memory")
        for button, order in (
            ("#forget-last", MemoryOrder("forget_last")),
            ("#export", MemoryOrder("export")),
            ("#private-mode", MemoryOrder("private")),
        ):
            await tab.click(button)
            assert await told(cabin) == order
        cabin.tell(MemoryState("ada", True, 90.0, 2, ENTRIES))
        await tab.until("document.getElementById('private').checkVisibility()")
        await tab.click("#tab-conversation")
        assert "nothing new is kept" in await text(tab, "private"), "seen whatever panel is open"
        await tab.click("#tab-memory")
        await tab.value(
            "((choice) => { choice.value = '7'; choice.dispatchEvent(new Event('change')); })"
            "(document.getElementById('retention'))"
        )
        assert await told(cabin) == MemoryOrder("retention", days=7.0)
        await tab.click("#erase")
        assert await tab.value("document.activeElement.id") == "erase-sure"
        assert "cannot be undone" in await text(tab, "sure-words") and cabin.take(0.2) is None
        assert "the key they are locked with" in await text(tab, "sure-words")
        await tab.click("#erase-sure")
        assert await told(cabin) == MemoryOrder("erase", sure=True)
        assert "on this machine, encrypted" not in await text(tab, "memory"), "not while nothing is kept"
        cabin.tell(MemoryState("ada", False, 90.0, 2, ENTRIES))
        await tab.until("document.getElementById('memory').textContent.includes('on this machine, encrypted')")
        cabin.tell(MemoryState("ada", False, 90.0, 2, ENTRIES, "chroma", encrypted=False))
        await tab.until("document.getElementById('memory').textContent.includes('in the memory “chroma”; the car')")
        await tab.click("#erase")
        assert "locked" not in await text(tab, "sure-words")

    with Cabin() as cabin:
        desk.run(check(cabin))


def test_words_of_people_and_models_stay_words(desk: Desk) -> None:
    async def check(cabin: Cabin) -> None:
        tab = desk.tab
        await tab.open(cabin.url)
        bad = "<img src=x onerror=\"document.title='broken'\"><script>document.title='broken'</script>"
        cabin.tell(SESSION)
        cabin.tell(Conversation("w1", bad, stage="driven", why=bad, thoughts=bad, policy="program", source=bad))
        cabin.tell(Note(bad, trouble=True))
        cabin.tell(HowWasIt("w1", bad))
        await tab.until("document.querySelector('#opinions.asked')")
        assert (await tab.value("document.querySelector('#wishes .said-words').textContent")) == bad
        assert await tab.value("document.querySelectorAll('main [onerror], main script').length") == 0
        assert "broken" not in await tab.value("document.title")
        assert bad in await text(tab, "opinion-of")

    with Cabin() as cabin:
        desk.run(check(cabin))


def test_a_lost_connection_is_said_keeps_what_was_typed_and_comes_back(desk: Desk) -> None:
    async def check(cabin: Cabin) -> None:
        tab = desk.tab
        await tab.open(cabin.url)
        cabin.tell(SESSION)
        await tab.until("!document.getElementById('talk-command').disabled")
        await tab.press("/")
        await tab.type("not yet sent")
        assert cabin._loop is not None
        for connection in list(cabin._room._screens):
            cabin._loop.call_soon_threadsafe(connection.transport.abort)
        await tab.until("document.getElementById('link').textContent === 'Connection lost'")
        assert "drives on by itself" in await text(tab, "banner")
        await tab.press("Enter")
        await tab.until("document.getElementById('notes').textContent.includes('Not sent')")
        assert await tab.value("document.getElementById('wish').value") == "not yet sent"
        await tab.until("document.getElementById('link').textContent === 'Connected'")
        await tab.until("!document.getElementById('talk-command').disabled")
        assert await tab.value("document.getElementById('banner').hidden")
        await tab.press("Enter")
        assert await told(cabin) == Say("not yet sent")
        cabin.tell(Ended("ended", "The drive has ended."))
        await tab.until("document.getElementById('link').textContent === 'Drive over'")
        assert "The drive has ended." in await text(tab, "banner")
        assert await tab.value("document.getElementById('stop').disabled")

    with Cabin() as cabin:
        desk.run(check(cabin))


@pytest.mark.skipif(not CHROMIUM, reason="no Chromium here")
def test_a_browser_without_a_microphone_says_so_and_typing_goes_on(tmp_path: Path) -> None:
    async def check(cabin: Cabin) -> None:
        async with browser(tmp_path) as tab:  # no microphone is plugged in, or the browser refuses it
            await tab.open(cabin.url)
            cabin.tell(SESSION)
            await tab.until("!document.getElementById('talk-command').disabled")
            await tab.finger("mousePressed", "#talk-command")
            await tab.until("document.getElementById('notes').textContent.includes('microphone')")
            await tab.finger("mouseReleased", "#talk-command")
            assert "type your wish" in await text(tab, "notes")
            await tab.press("/")
            await tab.type("Slower.")
            await tab.press("Enter")
            assert await told(cabin) == Say("Slower."), "and no button was told before"

    with Cabin() as cabin:
        asyncio.run(check(cabin))


RESAMPLED = """import(`${location.href}resample.js`).then(({ Resampler, toPcm }) => {
    const measure = (hz) => {
        const made = new Resampler(RATE);
        const wave = (i) => 0.5 * Math.sin(2 * Math.PI * hz * i / RATE);
        const out = [];
        for (let start = 0; start < RATE; start += 128) {
            out.push(...made.push(Float32Array.from({ length: 128 }, (_, i) => wave(start + i))));
        }
        const kept = out.slice(800, 15200);
        let [re, im] = [0, 0];
        kept.forEach((v, n) => {
            re += v * Math.cos(2 * Math.PI * hz * n / 16000);
            im += v * Math.sin(2 * Math.PI * hz * n / 16000);
        });
        const loud = Math.sqrt(kept.reduce((sum, v) => sum + v * v, 0) / kept.length * 2);
        return [out.length, 2 * Math.hypot(re, im) / kept.length, loud];
    };
    return [measure(440), measure(3000), measure(RATE / 2 - 1500), new Int16Array(toPcm([0, 1, -1, 2])).join()];
})"""


@pytest.mark.parametrize("rate_hz", [48_000, 44_100, 16_000, 8_000])
def test_sound_keeps_its_pitch_and_loses_what_16_khz_cannot_carry(desk: Desk, rate_hz: int) -> None:
    async def check(cabin: Cabin) -> None:
        await desk.tab.open(cabin.url)
        low, middle, high, pcm = await desk.tab.value(RESAMPLED.replace("RATE", str(rate_hz)))
        assert low[0] == pytest.approx(16_000, abs=200)
        assert low[1] == pytest.approx(0.5, rel=0.02) and middle[1] == pytest.approx(0.5, rel=0.03)
        assert rate_hz <= 16_000 or high[2] < 0.005, "nothing of it comes back as another tone"
        assert pcm == "0,32767,-32767,32767"

    with Cabin() as cabin:
        desk.run(check(cabin))
