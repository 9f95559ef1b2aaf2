"""`chauffeur show camera`: sheets of pictures."""

from __future__ import annotations

from pathlib import Path

from PIL import Image
from typer.testing import CliRunner

from chauffeur.cli.main import app


def test_a_sheet_has_a_picture_for_each_scene_and_weather(tmp_path: Path) -> None:
    out = tmp_path / "sheet.png"
    words = ["show", "camera", str(out), "--scenario", "intersection", "--weather", "sunny", "--weather", "night"]
    result = CliRunner().invoke(app, [*words, "--size", "96x54", "--columns", "2", "--truth", "--renderer", "painter"])
    assert result.exit_code == 0, result.output
    assert "2, rendered by NumPy" in " ".join(result.output.split())
    with Image.open(out) as sheet:
        assert sheet.size == (192, 54)
        day, night = (sheet.crop((x, 15, x + 96, 54)).convert("L").resize((1, 1)).getpixel((0, 0)) for x in (0, 96))
    assert isinstance(day, int) and isinstance(night, int) and night < 0.7 * day


def test_what_cannot_be_rendered_is_said(tmp_path: Path) -> None:
    for words, said in (
        (["--weather", "hail"], "no weather 'hail'"),
        (["--size", "big"], "'big' is no size"),
        (["--rig", "kitti"], "no camera rig 'kitti'"),
    ):
        result = CliRunner().invoke(app, ["show", "camera", str(tmp_path / "x.png"), *words])
        assert result.exit_code == 2 and said in result.output
        assert not (tmp_path / "x.png").exists()
