"""The training loop keeps what it has done when Ctrl-C comes, and goes on to the same weights."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

torch = pytest.importorskip("torch", reason="needs the extra `train`")

from chauffeur.models.train.trainer import Optimisation, fit, stored  # noqa: E402

STEPS = 12


def trained(folder: Path, at_step: Callable[[int, str], None] = lambda step, where: None, ema: float = 0.5) -> Any:
    """A small network after all steps; `at_step` is called inside of each, with what is being done."""
    torch.manual_seed(3)
    model = torch.nn.Sequential(torch.nn.Linear(4, 8), torch.nn.Tanh(), torch.nn.Linear(8, 1))

    def batches(first: int) -> Iterator[tuple[int, Any]]:
        for step in range(first, STEPS):
            at_step(step, "batch")
            yield step, torch.randn(16, 4, generator=torch.Generator().manual_seed(step))

    def loss(batch: tuple[int, Any]) -> Any:
        at_step(batch[0], "loss")
        value = (model(batch[1]) - batch[1].sum(dim=1, keepdim=True)).square().mean()
        value.register_hook(lambda _: at_step(batch[0], "gradient"))
        return value

    how = Optimisation(precision="float32", ema=ema)
    watch = lambda step, *_: at_step(step, "told")  # noqa: E731
    fit(model, batches, loss, lambda _: 0.01, folder, {"a": 1}, STEPS, how, watch=watch)
    return model


def weights(model: Any) -> list[Any]:
    return [one.detach().clone() for one in model.parameters()]


@pytest.mark.parametrize("where", ["batch", "loss", "gradient", "told"])
def test_ctrl_c_keeps_every_step_that_was_done(tmp_path: Path, where: str) -> None:
    whole = weights(trained(tmp_path / "at once"))

    def interrupt(step: int, what: str) -> None:
        if (step, what) == (5, where):
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        trained(tmp_path / "in parts", interrupt)
    state = stored(tmp_path / "in parts")
    assert state is not None and state["step"] == (6 if where == "told" else 5)
    again = weights(trained(tmp_path / "in parts"))
    assert all(torch.equal(one, other) for one, other in zip(whole, again, strict=True))


def test_ctrl_c_between_two_halves_of_a_step_waits_for_its_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = weights(trained(tmp_path / "at once"))
    step_once = torch.optim.AdamW.step
    done: list[int] = []

    def interrupted(self: Any, *given: Any) -> Any:
        done.append(1)
        if len(done) == 4:
            signal.raise_signal(signal.SIGINT)
        return step_once(self, *given)

    with monkeypatch.context() as patch:
        patch.setattr(torch.optim.AdamW, "step", interrupted)
        with pytest.raises(KeyboardInterrupt):
            trained(tmp_path / "in parts")
    state = stored(tmp_path / "in parts")
    assert state is not None and state["step"] == 4
    again = weights(trained(tmp_path / "in parts"))
    assert all(torch.equal(one, other) for one, other in zip(whole, again, strict=True))


def test_where_nothing_was_done_nothing_is_kept(tmp_path: Path) -> None:
    def interrupt(step: int, what: str) -> None:
        signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        trained(tmp_path, interrupt)
    assert stored(tmp_path) is None
