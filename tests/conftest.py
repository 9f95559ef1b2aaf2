"""Shared fixtures. Third-party data is read where it lies; tests that need it skip, and say why, where it is absent."""

from __future__ import annotations

import functools
import itertools
import os
import shutil
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import typer.testing
from hypothesis import settings

SHARED_DATA = Path(os.environ.get("CHAUFFEUR_TEST_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))

# Whoever starts the tests in the background may have these ignored, and every process that a test starts would inherit
# it: the signals that tests send must arrive.
for _number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
    if signal.getsignal(_number) == signal.SIG_IGN:
        signal.signal(_number, signal.default_int_handler if _number == signal.SIGINT else signal.SIG_DFL)

# As many workers as cores, and a thread each: two threads that wait for each other on a crowded machine take ten times
# as long. Workers and the processes of tests inherit it.
os.environ.setdefault("OMP_NUM_THREADS", "1")

# Building the tree of commands takes 80 ms, a command that refuses a file 2 ms: it is built once, as in a process.
typer.testing._get_command = functools.cache(typer.testing._get_command)  # pyright: ignore

# Everybody's run tries the same examples, however busy the machine; HYPOTHESIS_PROFILE=default looks for new ones.
settings.register_profile("same-for-all", derandomize=True, deadline=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "same-for-all"))


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--skipped-to", type=Path, metavar="FILE", help="names of skipped tests, for `pytest @FILE`")


def pytest_configure(config: pytest.Config) -> None:
    file = config.getoption("--skipped-to")
    if file is not None and not hasattr(config, "workerinput"):  # once, beside whatever runs the tests
        config.pluginmanager.register(_Skipped(file))


class _Skipped:
    """Collects which tests were skipped, so that they can be tried again where what they lacked has been installed."""

    def __init__(self, file: Path) -> None:
        self._file, self._names = file, set[str]()

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        self._note(report)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self._note(report)

    def _note(self, report: pytest.CollectReport | pytest.TestReport) -> None:
        if report.skipped:
            self._names.add(report.nodeid.partition("[")[0])

    def pytest_sessionfinish(self) -> None:
        self._file.write_text("".join(f"{name}\n" for name in sorted(self._names)), encoding="utf-8")


@pytest.fixture(scope="session")
def lampilot_data() -> Path:
    """Folder with `DbLv1-dev` and the peer's own outcomes."""
    folder = SHARED_DATA / "lampilot"
    if not (folder / "DbLv1-dev").is_dir():
        pytest.skip(f"LaMPilot data not found at {folder}; set CHAUFFEUR_TEST_DATA to the folder that holds lampilot/")
    return folder


@pytest.fixture(scope="session")
def _cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cache folder with nothing in it but the user's compiled kernels, which take half a minute to make."""
    from chauffeur.worlds.highway.core import jit

    cache = tmp_path_factory.mktemp("cache")
    (cache / "chauffeur").mkdir()
    (cache / "chauffeur" / Path(jit._STORE).name).symlink_to(jit._STORE)
    return cache


@pytest.fixture(scope="session")
def carla_data() -> Path:
    """Folder with the routes, triggers, maps and signal tables of CARLA's towns."""
    folder = SHARED_DATA / "carla"
    if not (folder / "maps").is_dir():
        pytest.skip(f"CARLA data not found at {folder}; set CHAUFFEUR_TEST_DATA to the folder that holds carla/")
    return folder


@pytest.fixture(scope="session")
def commands_data() -> Path:
    """Folder of real passengers' commands with labels, and the labels' scorer."""
    folder = SHARED_DATA / "commands"
    if not folder.is_dir():
        pytest.skip(
            f"Labelled commands not found at {folder}; set CHAUFFEUR_TEST_DATA to the folder that holds commands/"
        )
    return folder


@pytest.fixture(scope="session")
def case_folder() -> Callable[[str], Path]:
    """Gives the folder of an input from the field by its name; skips where it is absent."""

    def folder(name: str) -> Path:
        found = SHARED_DATA / "cases" / name
        if not found.is_dir():
            pytest.skip(f"The case {name} is not at {found}; set CHAUFFEUR_TEST_DATA to the folder that holds cases/")
        return found

    return folder


@pytest.fixture(scope="session")
def _homes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Names of home folders that do not exist until something is written there: most tests write nothing."""
    parent = tmp_path_factory.mktemp("homes")
    return (parent / str(number) for number in itertools.count())


@pytest.fixture(autouse=True)
def _private_home(monkeypatch: pytest.MonkeyPatch, _cache: Path, _homes: Iterator[Path]) -> Iterator[None]:
    """No test touches the user's profiles or cache, nor reads a reply that another has kept."""
    monkeypatch.setenv("CHAUFFEUR_HOME", str(next(_homes)))
    monkeypatch.setenv("XDG_CACHE_HOME", str(_cache))
    yield
    for kept in (_cache / "chauffeur").iterdir():
        if kept.name.startswith("replies-"):
            shutil.rmtree(kept)


@pytest.fixture(scope="session")
def speech() -> Callable[[str], bytes]:
    """A sentence in a synthetic voice, half a second of quiet before it and a second behind, as 16 kHz PCM."""
    if shutil.which("espeak-ng") is None:
        pytest.skip("espeak-ng is not installed")
    pytest.importorskip("soxr", reason="needs the extra `speech`")
    from chauffeur.speech.audio import SAMPLE_RATE_HZ, decode

    def speak(text: str) -> bytes:
        command = ["espeak-ng", "--stdin", "--stdout", "-v", "en-us", "-s", "150"]
        done = subprocess.run(command, input=text.encode(), capture_output=True, timeout=30, check=True)
        sound = decode(done.stdout).samples.astype(np.float64)
        sound = 12_000.0 * sound / np.abs(sound).max()
        quiet = np.zeros(SAMPLE_RATE_HZ // 2)
        sound = np.concatenate([quiet, sound, quiet, quiet])
        noise = np.random.default_rng(1).normal(0.0, 60.0, len(sound))
        return (sound + noise).astype("<i2").tobytes()

    return speak
