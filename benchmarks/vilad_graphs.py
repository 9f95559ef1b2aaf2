"""Passes recorded as CUDA graphs and replayed: a launch a pass in place of some thousand. For every decoder alike.

A recorded pass reads and writes the same memory each time, so what one leaves for the next (keys, values) lies where it
did. Recording is done once for each shape of pass, before anything is measured.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import torch

from chauffeur.models.vilad.decoding import PrefixCached, Twin, Uncached

Array = np.ndarray[Any, Any]


class _Recorded(Uncached):
    """A decoder whose passes are recorded when they are first asked for."""

    _passes: dict[tuple[Any, ...], tuple[torch.Tensor, torch.cuda.CUDAGraph, torch.Tensor]] | None = None
    _pool: Any = None
    _met: set[tuple[str, int]] = set()  # noqa: RUF012
    _aside: Any = None

    def run_pass(self, row: Array, compute: Callable[..., torch.Tensor], *given: int) -> Array:
        """See Uncached."""
        if self._passes is None:
            self._passes, self._pool, self._aside = {}, torch.cuda.graph_pool_handle(), torch.cuda.Stream()
            self._met = set()
        self.passes += 1
        key = (compute.__name__, *given)
        if key not in self._passes:
            rows = torch.from_numpy(row)[None].cuda()
            alike = (compute.__name__, given[0] - given[-1] if given else 0)  # as many tokens
            graph = torch.cuda.CUDAGraph()
            torch.cuda.synchronize()
            with torch.cuda.stream(self._aside):
                if alike not in self._met:  # libraries load kernels at the first call, which cannot be recorded
                    self._met.add(alike)
                    compute(rows, *given)
                graph.capture_begin(pool=self._pool)
                logits = compute(rows, *given)[0].float()
                graph.capture_end()
            torch.cuda.synchronize()
            self._passes[key] = (rows, graph, logits)
        rows, graph, logits = self._passes[key]
        rows.copy_(torch.from_numpy(row)[None])
        graph.replay()
        return logits.cpu().numpy()


class RecordedUncached(_Recorded):
    """`Uncached`, recorded."""


class RecordedPrefix(_Recorded, PrefixCached):
    """`PrefixCached`, recorded."""


class RecordedTwin(_Recorded, Twin):
    """`Twin`, recorded: a graph for each place of the template."""
