"""The page in a real browser, in real time: it loads, draws, and keys move the car. Skipped without Chromium."""

from __future__ import annotations

import asyncio
import json
import shutil
import subprocess
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import ClientConnection, connect
from wheel_rig import WHEN, dataset_of, run_of

from chauffeur.hmi.wheel.pace import WallClock
from chauffeur.hmi.wheel.server import serving
from chauffeur.hmi.wheel.session import Session

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

pytestmark = [pytest.mark.slow, pytest.mark.server, pytest.mark.skipif(not CHROMIUM, reason="no Chromium here")]

COLOURS = """(() => {
  const c = document.getElementById('road');
  const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
  const seen = new Set();
  for (let i = 0; i < d.length; i += 4 * 97) seen.add((d[i] << 16) | (d[i + 1] << 8) | d[i + 2]);
  return seen.size;
})()"""


class Tab:
    """A browser tab through the DevTools protocol."""

    def __init__(self, socket: ClientConnection) -> None:
        self._socket = socket
        self._count = 0
        self.troubles: list[Any] = []

    async def ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        self._count += 1
        await self._socket.send(json.dumps({"id": self._count, "method": method, "params": parameters}))
        while True:
            answer = json.loads(await self._socket.recv())
            if answer.get("method") in ("Runtime.exceptionThrown", "Log.entryAdded"):
                self.troubles.append(answer["params"])
            if answer.get("id") == self._count:
                assert "error" not in answer, answer
                return answer["result"]

    async def value(self, expression: str) -> Any:
        result = await self.ask("Runtime.evaluate", expression=expression, returnByValue=True)
        return result["result"].get("value")

    async def until(self, expression: str) -> None:
        async with asyncio.timeout(60):
            while not await self.value(expression):
                await asyncio.sleep(0.05)

    async def key(self, code: str, number: int, seconds: float = 0.05) -> None:
        for kind in ("rawKeyDown", "keyUp"):
            await self.ask("Input.dispatchKeyEvent", type=kind, code=code, key=code, windowsVirtualKeyCode=number)
            await asyncio.sleep(seconds if kind == "rawKeyDown" else 0.0)


@asynccontextmanager
async def browser(profile: Path) -> AsyncGenerator[Tab]:
    assert CHROMIUM is not None
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0", f"--user-data-dir={profile}"]
    process = subprocess.Popen([CHROMIUM, *options, "about:blank"], stderr=subprocess.PIPE, text=True)
    try:
        assert process.stderr is not None
        line = ""
        while "DevTools listening on" not in line:
            line = await asyncio.to_thread(process.stderr.readline)
            assert line, "Chromium did not start"
        async with connect(line.rsplit(" ", 1)[1].strip(), max_size=None) as root:
            targets = (await Tab(root).ask("Target.getTargets"))["targetInfos"]
            page = next(target["targetId"] for target in targets if target["type"] == "page")
        async with connect(line.rsplit(" ", 1)[1].split("/devtools")[0] + f"/devtools/page/{page}") as socket:
            tab = Tab(socket)
            for domain in ("Page", "Runtime", "Log"):
                await tab.ask(f"{domain}.enable")
            yield tab
    finally:
        process.kill()
        await asyncio.to_thread(process.wait)


def test_the_page_draws_the_road_and_its_keys_move_the_car(tmp_path: Path) -> None:
    run = run_of(tmp_path / "run", dataset_of(tmp_path / "data", "dec_rel_speed4"))

    async def drive() -> None:
        session = Session(run, WallClock(), lambda: WHEN)
        async with serving(session) as server, browser(tmp_path / "profile") as tab:
            driving = asyncio.create_task(session.drive_all())
            await tab.ask("Page.navigate", url=server.url)
            await tab.until("typeof stage === 'object' && stage.stage === 'ready'")
            assert (
                await tab.value("document.getElementById('command').textContent") == "Slow down by 4 meters per second."
            )
            assert "Simulated" in await tab.value("document.getElementById('simulated').textContent")
            await asyncio.sleep(0.6)
            assert await tab.value(COLOURS) > 5, "grass, verge, asphalt, lines, car"
            await tab.key("Enter", 13)
            await tab.until("tick.phase === 'driving' && tick.time > 0.2")
            speed, y = await tab.value("tick.ego[3]"), await tab.value("tick.ego[1]")
            await tab.key("ArrowUp", 38, 0.5)
            await tab.key("ArrowLeft", 37, 0.5)
            await tab.until("tick.time > 2.5")
            assert await tab.value("tick.ego[3]") > speed + 0.3, "gas"
            assert await tab.value("tick.ego[1]") < y - 0.2, "left"
            await tab.key("Space", 32)
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
