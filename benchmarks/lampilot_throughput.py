"""How close a run comes to what an endpoint allows: a real HTTP server on loopback with a latency and a cap.

    python benchmarks/lampilot_throughput.py [--requests 1000] [--latency 1.5] [--allowed 64] [--concurrency 64 256]

The server answers each call after `--latency` seconds and refuses (429) whatever comes while `--allowed` calls are in
flight, so at best it answers allowed / latency calls a second. The run is a whole one: words, prompts, HTTP, checks,
storage and simulation, with every core simulating while calls are in flight. Throughput is taken at the server, from
the first call's arrival to the last answer, ramp and all. With a `--concurrency` above what is allowed the cap has to
be found. `own CPU` is what this process spends on an item: prompt, HTTP, check of the program, storage. `longest stall`
is how long the event loop kept anybody waiting at most (the import of the HTTP client at the first call, mostly).
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
import urllib.request
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

PROGRAM = "def hold():\n    set_target_speed({speed})\n    for _ in range(20):\n        yield autopilot()\n"
COMMANDS = 40


@dataclass
class Server:
    """Answers after a while, and never more than so many at a time."""

    latency_s: float
    allowed: int
    in_flight: int = 0
    busiest: int = 0
    answered: int = 0
    refused: int = 0
    first_s: float = 0.0
    last_s: float = 0.0

    async def talk(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            while True:
                head = (await reader.readuntil(b"\r\n\r\n")).decode("latin-1").lower()
                length = int(head.partition("content-length:")[2].partition("\r\n")[0] or 0)
                body = await reader.readexactly(length)
                status, answer = (200, self.stats()) if head.startswith("get ") else await self.answer(body)
                data = json.dumps(answer).encode()
                lead = f"HTTP/1.1 {status} X\r\nContent-Type: application/json\r\nContent-Length: {len(data)}\r\n\r\n"
                writer.write(lead.encode() + data)
                await writer.drain()
        except (asyncio.IncompleteReadError, ConnectionError):
            pass
        finally:
            writer.close()

    async def answer(self, body: bytes) -> tuple[int, Any]:
        now_s = time.monotonic()
        self.first_s = self.first_s or now_s
        if self.in_flight >= self.allowed:
            self.refused += 1
            return 429, {"error": {"message": "Too many calls at a time.", "type": "rate_limit"}}
        self.in_flight += 1
        self.busiest = max(self.busiest, self.in_flight)
        await asyncio.sleep(self.latency_s)
        self.in_flight -= 1
        self.answered += 1
        self.last_s = time.monotonic()
        source = PROGRAM.format(speed=20 + self.answered % 4)
        content = f"Thoughts: Hold the speed.\n\n```python\n{source}```\n"
        return 200, {
            "id": "c", "object": "chat.completion", "created": 1, "model": "served",
            "choices": [{"index": 0, "message": {"role": "assistant", "content": content}, "finish_reason": "stop"}],
            "usage": {"prompt_tokens": len(body) // 4, "completion_tokens": 60, "total_tokens": len(body) // 4 + 60},
        }  # fmt: skip

    def stats(self) -> dict[str, Any]:
        return {
            "answered": self.answered,
            "refused": self.refused,
            "busiest": self.busiest,
            "span_s": self.last_s - self.first_s,
        }


def serve(latency_s: float, allowed: int) -> None:
    async def main() -> None:
        server = await asyncio.start_server(Server(latency_s, allowed).talk, "127.0.0.1", 0, backlog=1024)
        print(server.sockets[0].getsockname()[1], flush=True)
        await server.serve_forever()

    asyncio.run(main())


def make_data(folder: Path, requests: int) -> None:
    from chauffeur.worlds.highway.scenarios import BUILT_IN

    road = next(s for s in BUILT_IN if s.id == "following").config
    goal = {"type": "ACCEvalbySpeed", "speed": 5}
    seeds = (9, 19, 23, 24, 25, 29)
    samples = [
        {"env": {**road, "vehicles_density": 0.5 + 0.01 * i}, "eval": goal, "seed": seeds[i % len(seeds)]}
        for i in range(-(-requests // COMMANDS))
    ]
    commands = [f"Go at a speed of {i} m/s." for i in range(COMMANDS)]
    folder.mkdir()
    (folder / "speed.json").write_text(json.dumps({"commands": commands, "samples": samples}))


def measure(data: Path, folder: Path, requests: int, latency_s: float, allowed: int, concurrency: int) -> str:
    from chauffeur.bench.kernel.pipeline import TELL_S
    from chauffeur.bench.kernel.run import BenchRun, Effort
    from chauffeur.bench.lampilot import lampilot
    from chauffeur.planners.registry import make_planner

    command = [sys.executable, __file__, "--serve", "--latency", str(latency_s), "--allowed", str(allowed)]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert server.stdout is not None
        url = f"http://127.0.0.1:{int(server.stdout.readline())}/v1"
        planner = make_planner("openai/m", base_url=url, attempts=1, stream=False, cache=False)
        run = BenchRun(folder, lampilot(data, "openai/m", items=requests, seed=1), planner)
        before = resource.getrusage(resource.RUSAGE_SELF)
        started_s = time.monotonic()
        told: list[float] = []
        rows = run.run(lambda _: told.append(time.monotonic()), Effort(concurrency=concurrency))
        whole_s = time.monotonic() - started_s
        after = resource.getrusage(resource.RUSAGE_SELF)
        with urllib.request.urlopen(url) as answer:
            stats = json.load(answer)
    finally:
        server.terminate()
        server.wait()
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    drives = len({row["rollout_key"] for row in rows})
    rate = stats["answered"] / stats["span_s"]
    stall_s = max(b - a for a, b in pairwise(told)) - TELL_S
    failed = sum(row["infra_failed"] for row in rows)
    return (
        f"| {concurrency} | {stats['answered']} | {stats['refused']} | {stats['busiest']} | {stats['span_s']:.1f} "
        f"| {rate:.1f} | {100 * rate * latency_s / allowed:.1f} % | {drives} | {whole_s:.1f} "
        f"| {1000 * cpu_s / len(rows):.1f} | {1000 * stall_s:.0f} | {failed} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--requests", type=int, default=1000)
    parser.add_argument("--latency", type=float, default=1.5)
    parser.add_argument("--allowed", type=int, default=64)
    parser.add_argument("--concurrency", type=int, nargs="+", default=[64, 256])
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.serve:
        serve(given.latency, given.allowed)
        return
    print(
        f"{given.requests} requests, {given.latency} s latency, {given.allowed} allowed in flight: at best "
        f"{given.allowed / given.latency:.1f}/s. {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}.\n"
    )
    print("| concurrency | answered | refused | most in flight | span s | calls/s | of ideal | drives | run s "
          "| own CPU ms an item | longest stall ms | failed |")  # fmt: skip
    print("|" + "---:|" * 12)
    with tempfile.TemporaryDirectory() as folder:
        make_data(Path(folder) / "data", given.requests)
        for n, concurrency in enumerate(given.concurrency):
            run = Path(folder) / f"run{n}"
            line = measure(Path(folder) / "data", run, given.requests, given.latency, given.allowed, concurrency)
            print(line, flush=True)


if __name__ == "__main__":
    main()
