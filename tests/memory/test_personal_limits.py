"""Limits a person keeps in a file: stricter only, never looser, and nobody drives on half a file."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.concept import LAMPILOT_LIMITS, NOBODY, ConfigError, Limits, PersonId
from chauffeur.memory.personal_limits import personal_limits

ANA, BEN = PersonId("ana"), PersonId("ben")
FILE = """
[everybody]
max_speed_kmh = 126

[ana]
max_speed_kmh = 90
max_over_limit_kmh = 0
min_time_headway_s = 1.5
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "limits.toml"
    file.write_text(FILE)
    return file


def test_a_persons_table_holds_beside_everybodys(path: Path) -> None:
    ana = personal_limits(ANA, Limits(), path)
    assert (ana.max_speed_mps, ana.max_over_limit_mps, ana.min_time_headway_s) == (pytest.approx(25.0), 0.0, 1.5)
    assert ana.name == "default+everybody+ana", "results name the limits they were driven under"
    assert personal_limits(BEN, Limits(), path).max_speed_mps == pytest.approx(35.0)
    assert personal_limits(NOBODY, Limits(), path).max_speed_mps == pytest.approx(35.0)


def test_without_a_file_nothing_changes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CHAUFFEUR_HOME", str(tmp_path))
    assert personal_limits(ANA, Limits()) == Limits()
    (tmp_path / "limits.toml").write_text(FILE)
    assert personal_limits(ANA, Limits()).max_speed_mps == pytest.approx(25.0), "the installation's own file"


@given(
    speed=st.floats(1.0, 250.0), over=st.floats(0.0, 50.0), headway=st.floats(0.0, 10.0),
    base=st.sampled_from([Limits(), LAMPILOT_LIMITS, Limits(max_speed_mps=20.0, min_time_headway_s=2.0)]),
    sign=st.floats(1.0, 60.0),
)  # fmt: skip
def test_no_table_makes_any_limit_looser(
    tmp_path_factory: pytest.TempPathFactory, speed: float, over: float, headway: float, base: Limits, sign: float
) -> None:
    path = tmp_path_factory.getbasetemp() / "limits.toml"
    path.write_text(
        f"[ana]\nmax_speed_kmh = {speed!r}\nmax_over_limit_kmh = {over!r}\nmin_time_headway_s = {headway!r}\n"
    )
    own = personal_limits(ANA, base, path)
    assert own.most_mps(sign) <= base.most_mps(sign)
    assert own.min_time_headway_s >= base.min_time_headway_s
    assert own.min_time_headway_s <= own.max_time_headway_s


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("[ana]\nmax_sped_kmh = 90", "no limit 'max_sped_kmh'"),
        ("[ana]\nmax_speed_kmh = 'fast'", "no number"),
        ("[ana]\nmax_speed_kmh = nan", "no number"),
        ("[ana]\nmax_speed_kmh = true", "no number"),
        ("[ben]\nmax_speed_kmh = -5", "no number"),
        ("max_speed_kmh = 90", "outside a table"),
        ("[ana\nmax", "no TOML"),
        (b"\xff\xfe", "cannot be read"),
    ],
)
def test_a_file_with_a_fault_stops_every_drive_in_words(tmp_path: Path, content: str | bytes, words: str) -> None:
    path = tmp_path / "limits.toml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(ConfigError, match=words):
        personal_limits(ANA, Limits(), path)
