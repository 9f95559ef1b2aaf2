"""A headless Chromium through the DevTools protocol: the page as a person has it, with their keys, finger and voice."""

from __future__ import annotations

import asyncio
import base64
import itertools
import json
import shutil
import subprocess
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

from websockets.asyncio.client import ClientConnection, connect

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
PATIENCE_S = 60.0

TABLET = (1024, 768)
PHONE = (390, 844)

_KEYS = {
    " ": ("Space", 32),
    "Enter": ("Enter", 13),
    "Tab": ("Tab", 9),
    "Escape": ("Escape", 27),
    "ArrowLeft": ("ArrowLeft", 37),
    "ArrowUp": ("ArrowUp", 38),
    "ArrowDown": ("ArrowDown", 40),
    "ArrowRight": ("ArrowRight", 39),
    "/": ("Slash", 191),
}


class Tab:
    """A browser tab."""

    def __init__(self, socket: ClientConnection) -> None:
        self._socket = socket
        self._numbers = itertools.count(1)
        self.troubles: list[Any] = []

    async def ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        """A command of the protocol, and its answer."""
        number = next(self._numbers)
        await self._socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            answer = json.loads(await self._socket.recv())
            if answer.get("method") in ("Runtime.exceptionThrown", "Log.entryAdded"):
                self.troubles.append(answer["params"])
            if answer.get("id") == number:
                assert "error" not in answer, answer
                return answer["result"]

    async def value(self, expression: str) -> Any:
        """Of an expression, or of what it promises."""
        answer = await self.ask("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    async def until(self, expression: str) -> None:
        """Come back when it is true."""
        async with asyncio.timeout(PATIENCE_S):
            while not await self.value(f"Boolean({expression})"):
                await asyncio.sleep(0.05)

    async def open(
        self, url: str, size: tuple[int, int] = TABLET, *, scheme: str = "light", calm: bool = False
    ) -> None:
        """A page on a screen of this size, for a person with these preferences; its troubles are counted anew."""
        await self.ask("Page.navigate", url="about:blank")  # the page before stops calling a server that has ended
        await self.until("location.href === 'about:blank' && document.readyState === 'complete'")
        self.troubles.clear()
        width, height = size
        await self.ask(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False
        )
        await self.prefer(scheme=scheme, calm=calm)
        await self.ask("Page.navigate", url=url)
        await self.until("location.href !== 'about:blank' && document.readyState === 'complete'")

    async def prefer(self, *, scheme: str = "light", calm: bool = False) -> None:
        """What the person prefers."""
        features = {"prefers-color-scheme": scheme, "prefers-reduced-motion": "reduce" if calm else "no-preference"}
        await self.ask(
            "Emulation.setEmulatedMedia", features=[{"name": name, "value": value} for name, value in features.items()]
        )

    async def down(self, key: str, *, shift: bool = False) -> None:
        """A key goes down."""
        await self._key("keyDown", key, shift)

    async def up(self, key: str, *, shift: bool = False) -> None:
        """And up."""
        await self._key("keyUp", key, shift)

    async def press(self, *keys: str, shift: bool = False) -> None:
        """Each down and up."""
        for key in keys:
            await self.down(key, shift=shift)
            await self.up(key, shift=shift)

    async def _key(self, kind: str, key: str, shift: bool) -> None:
        code, number = _KEYS.get(key, (f"Key{key.upper()}", ord(key.upper()[0])))
        text = {"Enter": "\r"}.get(key, key if len(key) == 1 else "")
        more = {"text": text} if kind == "keyDown" and text else {}
        await self.ask(
            "Input.dispatchKeyEvent",
            type=kind if more or kind == "keyUp" else "rawKeyDown",
            key=key,
            code=code,
            windowsVirtualKeyCode=number,
            modifiers=8 if shift else 0,
            **more,
        )

    async def type(self, text: str) -> None:
        """Into what has the focus."""
        await self.ask("Input.insertText", text=text)

    async def finger(self, kind: str, selector: str) -> None:
        """`mousePressed` or `mouseReleased` in the middle of an element."""
        x, y = await self._middle(selector)
        await self.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    async def _middle(self, selector: str) -> list[float]:
        return await self.value(
            f"(() => {{ const r = document.querySelector({json.dumps(selector)}).getBoundingClientRect();"
            " return [r.x + r.width / 2, r.y + r.height / 2]; })()"
        )

    async def click(self, selector: str) -> None:
        """A short touch, once the element lies still: what is said above a button moves it."""
        seen: list[float] = []
        while seen != (seen := await self._middle(selector)):
            await asyncio.sleep(0.1)
        await self.finger("mousePressed", selector)
        await self.finger("mouseReleased", selector)

    async def picture(self, path: Path) -> None:
        """Of what is seen now, as PNG."""
        answer = await self.ask("Page.captureScreenshot", format="png")
        path.write_bytes(base64.b64decode(answer["data"]))


@asynccontextmanager
async def browser(profile: Path, *options: str) -> AsyncGenerator[Tab]:
    """A browser with one tab, for as long as the context lasts."""
    assert CHROMIUM is not None
    fixed = ["--headless", "--no-sandbox", "--disable-gpu", "--mute-audio", "--remote-debugging-port=0"]
    fixed += ["--no-first-run", "--disable-extensions", "--disable-sync", "--disable-background-networking"]
    fixed += ["--disable-component-update", "--disable-default-apps"]
    command = [CHROMIUM, *fixed, f"--user-data-dir={profile}", *options, "about:blank"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stderr is not None
        line = ""
        while "DevTools listening on" not in line:
            line = await asyncio.to_thread(process.stderr.readline)
            assert line, "Chromium did not start"
        address = line.rsplit(" ", 1)[1].strip()
        async with connect(address, max_size=None) as root:
            targets = (await Tab(root).ask("Target.getTargets"))["targetInfos"]
            page = next(target["targetId"] for target in targets if target["type"] == "page")
        async with connect(f"{address.split('/devtools')[0]}/devtools/page/{page}", max_size=None) as socket:
            tab = Tab(socket)
            for domain in ("Page", "Runtime", "Log"):
                await tab.ask(f"{domain}.enable")
            yield tab
    finally:
        process.kill()
        await asyncio.to_thread(process.wait)
