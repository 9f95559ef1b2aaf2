"""A drive seen, and broken, from the outside: its processes by their ids, what control reports, what the host says."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Literal, Self

from chauffeur.bench.chaos.cases import Surroundings
from chauffeur.concept import SandboxError
from chauffeur.drive.live.messages import MessageError, Report
from chauffeur.drive.live.plan_messages import read_event
from chauffeur.drive.live.ring import Reader
from chauffeur.drive.live.settings import Settings, ring
from chauffeur.planners.cache import default_cache_dir
from chauffeur.safety.audit.reader import read_records

Role = Literal["host", "control", "policy", "spare", "planner", "worker"]
"""`worker`: of the sandbox."""

READY_WITHIN_S: Final = 180.0
GONE_WITHIN_S: Final = 30.0
PERSON: Final = "ana"
_JUMPING: Final = Path(__file__).parent / "jumping"


@dataclass(frozen=True, slots=True)
class HeardOutside:
    """A report of control, and when it was written, by the clock of all processes."""

    report: Report
    at_ns: int


class OutsideDrive:
    """The processes of one drive, started by a host process of their own."""

    def __init__(self, settings: Settings, surroundings: Surroundings) -> None:
        """Start.

        Raises:
            SandboxError: It does not get ready.
        """
        self.settings = settings
        self.folder = Path(tempfile.mkdtemp(prefix="chauffeur-chaos-"))
        self.audit = Path("/dev/full") if surroundings == "full-device" else self.folder / "audit.jsonl"
        self.home = self.folder / "home"
        self.said: list[dict[str, Any]] = []
        self.lost_reports = 0
        self._lines: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
        self._known: set[int] = set()
        self._named: dict[Role, int] = {}
        settings.write(self.folder)
        environment = os.environ | {
            "XDG_CACHE_HOME": str(_own_cache(self.folder / "cache")),
            "CHAUFFEUR_HOME": str(self.home),
        }
        if surroundings == "jumping-clock":
            environment["PYTHONPATH"] = os.pathsep.join([str(_JUMPING), *filter(None, [environment.get("PYTHONPATH")])])
        self.errors = self.folder / "host.log"
        with self.errors.open("wb") as log:
            self._host = subprocess.Popen(  # noqa: S603 - this package's own process
                [sys.executable, "-m", "chauffeur.bench.chaos.host", str(self.folder), str(self.audit)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                env=environment,
                start_new_session=True,
            )
        self._vandal: subprocess.Popen[bytes] | None = None
        threading.Thread(target=self._listen, daemon=True).start()
        try:
            self.shared = self._get_ready()
            self._reports = Reader(ring(self.shared, "reports"), old=True)
            self._events = Reader(ring(self.shared, "policy_events"), old=True)
            self._vandal = subprocess.Popen(  # noqa: S603 - this package's own process
                [sys.executable, "-m", "chauffeur.bench.chaos.vandal", str(self.shared)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                start_new_session=True,
            )
        except BaseException:
            self.end()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.end()

    # What it says -----------------------------------------------------------------------------------------------------

    def reports(self) -> list[HeardOutside]:
        """Reports of control since the last call."""
        messages, lost = self._reports.news()
        self.lost_reports += lost
        return [HeardOutside(Report.decode(message.payload), message.written_ns) for message in messages]

    def started(self) -> list[str]:
        """Names of plans that the policy has started, or gone on with, since the last call: they passed the checks.

        Read where the policy says it, not where the supervisor hands it on: what it says of a wish that was answered
        already is not handed on.
        """
        names: list[str] = []
        for message in self._events.news()[0]:
            with contextlib.suppress(MessageError):
                event = read_event(message.payload)
                if event.kind in ("started", "resumed"):
                    names.append(event.wish)
        return names

    def lines(self) -> list[dict[str, Any]]:
        """What the host said since the last call."""
        fresh: list[dict[str, Any]] = []
        while True:
            try:
                fresh.append(self._lines.get_nowait())
            except queue.Empty:
                self.said.extend(fresh)
                for line in fresh:
                    self._named.update(line.get("processes", {}))
                return fresh

    def ask(self, words: str, of: int) -> None:
        """Ask a wish, for a case; the host says which name it got."""
        self._tell(self._host, {"ask": words, "person": PERSON, "of": of})

    def records(self) -> dict[str, str]:
        """Wishes in the audit log with the outcome that stands there, empty for none; nothing where there is no log."""
        found: dict[str, str] = {}
        if not self.audit.is_file():
            return found
        for _, record in read_records(self.audit):
            if record.kind == "wish":
                found.setdefault(str(record.body["wish"]), "")
            elif record.kind == "outcome" and "wish" in record.body:
                found[str(record.body["wish"])] = str(record.body["outcome"])
        return found

    # Its processes ----------------------------------------------------------------------------------------------------

    def processes(self) -> dict[Role, int]:
        """Ids of the processes that live, by role."""
        found: dict[Role, int] = {}
        workers = self.workers = list[int]()
        if self._host.poll() is None:
            found["host"] = self._host.pid
        found.update({role: pid for role, pid in self._named.items() if _lives(pid)})
        for role in ("policy", "spare"):
            for pid in _children(found[role]) if role in found else ():
                self._known.add(pid)
                if role == "policy":
                    workers.append(pid)
        self._known.update(found.values())
        return found

    def processes_left(self) -> tuple[Role, ...]:
        """Roles of the processes that were ever seen and live."""
        return tuple(_role(pid) for pid in self._known if _lives(pid))

    def kill_workers(self) -> int:
        """Kill the sandbox workers of the policy; how many there were."""
        self.processes()
        for pid in self.workers:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        return len(self.workers)

    def send(self, role: Role, number: signal.Signals) -> bool:
        """Send a signal; whether there was somebody to get it."""
        pid = self.processes().get(role)
        if pid is None:
            return False
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, number)
            return True
        return False

    def fill_disk(self, role: Role, full: bool) -> bool:
        """Let a process write no further byte into any file, or as many as it likes; whether it was there."""
        pid = self.processes().get(role)
        if pid is None:
            return False
        limit = 0 if full else resource.RLIM_INFINITY
        resource.prlimit(pid, resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
        return True

    def spoil_profile(self, draw: int) -> None:
        """Put something else where the person's memory lies."""
        profiles = self.home / "profiles"
        if draw % 2 and not profiles.exists():
            self.home.mkdir(parents=True, exist_ok=True)
            profiles.write_bytes(b"this is no folder")
        elif not profiles.exists():
            profiles.mkdir(parents=True, exist_ok=True)
            (self.home / "keys").write_bytes(b"this is no folder")

    def mend_profile(self) -> None:
        """Take it away again."""
        for path in (self.home / "profiles", self.home / "keys"):
            if path.is_dir():
                shutil.rmtree(path)
            else:
                path.unlink(missing_ok=True)

    def forget_replies(self) -> None:
        """Remove the replies that the planner keeps: what an earlier case spoilt must not come up again."""
        for reply in (self.folder / "cache" / "chauffeur").glob("replies-*/**/*"):
            if reply.is_file():
                reply.unlink(missing_ok=True)

    def scribble(self, what: str, draw: int, for_s: float) -> bool:
        """Have the vandal do a deed, while all goes on; whether it lives."""
        assert self._vandal is not None
        self._tell(self._vandal, {"what": what, "draw": draw, "for_s": for_s})
        return self._vandal.poll() is None

    def wait_gone(self) -> tuple[Role, ...]:
        """Wait until the processes have ended after the host's death; names those that have not."""
        until_s = time.monotonic() + GONE_WITHIN_S
        while time.monotonic() < until_s:
            if not self.processes_left():
                return ()
            time.sleep(0.02)
        return self.processes_left()

    def known(self) -> frozenset[int]:
        """Ids of every process of the drive that was ever seen."""
        return frozenset(self._known)

    @property
    def running(self) -> bool:
        """Whether the host lives."""
        return self._host.poll() is None

    def finish(self, within_s: float = 60.0) -> None:
        """Tell the host that there is no more, and wait for it."""
        with contextlib.suppress(OSError):
            assert self._host.stdin is not None
            self._host.stdin.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._host.wait(within_s)

    def end(self) -> None:
        """Whatever is left of it is ended and removed."""
        self.processes()
        for process in (self._vandal, self._host):
            if process is not None:
                with contextlib.suppress(OSError):
                    process.kill()
                process.wait()
        for pid in self._known:
            if _lives(pid) and _role(pid) != "host":
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
        if hasattr(self, "shared"):
            shutil.rmtree(self.shared, ignore_errors=True)
        shutil.rmtree(self.folder, ignore_errors=True)

    def _get_ready(self) -> Path:
        until_s = time.monotonic() + READY_WITHIN_S
        while time.monotonic() < until_s and self._host.poll() is None:
            for line in self.lines():
                if "ready" in line:
                    self.processes()
                    return Path(line["ready"])
            time.sleep(0.01)
        words = self.errors.read_text(errors="replace").strip().splitlines()
        raise SandboxError("The drive does not get ready.", hint=words[-1] if words else "")

    def _listen(self) -> None:
        assert self._host.stdout is not None
        for line in self._host.stdout:
            with contextlib.suppress(ValueError):  # the last line of a killed host may be torn
                self._lines.put(json.loads(line))

    @staticmethod
    def _tell(process: subprocess.Popen[bytes], what: dict[str, Any]) -> None:
        assert process.stdin is not None
        with contextlib.suppress(OSError):
            process.stdin.write(json.dumps(what).encode() + b"\n")
            process.stdin.flush()


def _own_cache(folder: Path) -> Path:
    """A cache folder of the drive's own, so that no reply of an earlier case is found in it; machine code is shared."""
    own, shared = folder / "chauffeur", default_cache_dir()
    own.mkdir(parents=True)
    for kernels in shared.glob("kernels-*"):
        (own / kernels.name).symlink_to(kernels)
    return folder


def settings_for(settings: Settings, surroundings: Surroundings) -> Settings:
    """Settings of a drive in these surroundings."""
    if surroundings == "onboard":
        return replace(settings, planner="onboard", base_url=None)
    return settings


def _children(pid: int) -> Iterator[int]:
    with contextlib.suppress(OSError):
        for task in Path(f"/proc/{pid}/task").iterdir():
            yield from (int(child) for child in (task / "children").read_text().split())


def _words(pid: int) -> list[str]:
    try:
        return Path(f"/proc/{pid}/cmdline").read_text(errors="replace").split("\0")
    except OSError:
        return []


def _lives(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (OSError, IndexError):
        return False
    return state not in "ZX"


def _role(pid: int) -> Role:
    words = _words(pid)
    if "chauffeur.drive.live" in words:
        return words[words.index("chauffeur.drive.live") + 1]  # type: ignore[return-value]
    return "host" if "chauffeur.bench.chaos.host" in words else "worker"
