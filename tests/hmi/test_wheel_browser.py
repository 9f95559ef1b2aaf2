"""The page in a real browser, in real time: it loads, draws, and keys move the car. Skipped without Chromium."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path

import pytest
from wheel_rig import WHEN, dataset_of, run_of

sys.path.append(str(Path(__file__).parent / "cabin"))

from chromium import CHROMIUM, Tab, browser

from chauffeur.hmi.wheel.pace import WallClock
from chauffeur.hmi.wheel.server import serving
from chauffeur.hmi.wheel.session import WheelSession

pytestmark = [pytest.mark.slow, pytest.mark.server, pytest.mark.skipif(not CHROMIUM, reason="no Chromium here")]

COLOURS = """(() => {
  const c = document.getElementById('road');
  const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
  const seen = new Set();
  for (let i = 0; i < d.length; i += 4 * 97) seen.add((d[i] << 16) | (d[i + 1] << 8) | d[i + 2]);
  return seen.size;
})()"""


async def hold(tab: Tab, key: str, seconds: float = 0.05) -> None:
    await tab.down(key)
    await asyncio.sleep(seconds)
    await tab.up(key)


def test_the_page_draws_the_road_and_its_keys_move_the_car(tmp_path: Path) -> None:
    run = run_of(tmp_path / "run", dataset_of(tmp_path / "data", "dec_rel_speed4"))

    async def drive() -> None:
        session = WheelSession(run, WallClock(), lambda: WHEN)
        async with serving(session) as server, browser(tmp_path / "profile") as tab:
            driving = asyncio.create_task(session.drive_all())
            await tab.open(server.url)
            await tab.until("typeof stage === 'object' && stage?.stage === 'ready'")
            assert (
                await tab.value("document.getElementById('command').textContent") == "Slow down by 4 meters per second."
            )
            assert "Simulated" in await tab.value("document.getElementById('simulated').textContent")
            await asyncio.sleep(0.6)
            assert await tab.value(COLOURS) > 5, "grass, verge, asphalt, lines, car"
            await hold(tab, "Enter")
            await tab.until("tick.phase === 'driving' && tick.time > 0.2")
            speed, y = await tab.value("tick.ego[3]"), await tab.value("tick.ego[1]")
            await hold(tab, "ArrowUp", 0.5)
            await hold(tab, "ArrowLeft", 0.5)
            await tab.until("tick.time > 2.5")
            assert await tab.value("tick.ego[3]") > speed + 0.3, "gas"
            assert await tab.value("tick.ego[1]") < y - 0.2, "left"
            await hold(tab, " ")
            await tab.until("tick.phase === 'paused' && document.getElementById('card-title').offsetParent !== null")
            await tab.value("document.getElementById('give-up').click()")
            await tab.until("stage.stage === 'result' && 'driven' in stage")
            assert not tab.troubles
            driving.cancel()
            await asyncio.gather(driving, return_exceptions=True)

    asyncio.run(drive())
    trace = run.trace(run.items[0].id)
    assert trace is not None and {0, 1, 4} <= set(trace.keys)
    run.close()
