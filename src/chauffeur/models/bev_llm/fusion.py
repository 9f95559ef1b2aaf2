# pyright: reportUntypedBaseClass=false, reportUnknownParameterType=false
"""BEV fusion: history of many views gathered in cells, and given back to the views (Eq. 9 and 10, Fig. 5).

For every instant, oldest first:

    B_t = TSA(Q, {Q, B_{t-1}}) + B_{t-1}                       (Eq. 9; at the first instant B_{t-1} = Q)
    B_t = B_t + SCA(B_t, V_t with its rays, geometric bias)    (how V enters B: BEVFormer's spatial cross-attention,
                                                               which Eq. 9 leaves out)

and at the last one

    V_att = SFA(V_T, B_proj) + V_T                             (Eq. 10: views are queries, cells keys and values)

Features of several layers of the vision encoder come in one after the other; the last one feeds B, and Eq. 10 is
applied to each.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import nn

from chauffeur.models.bev_llm.geometry import BevGrid, RigGeometry


@dataclass(frozen=True, slots=True)
class FusionConfig:
    """Shape of the fusion.

    Attributes:
        width: Numbers of a feature of one layer of the vision encoder.
        layers: How many layers' features come in.
        bev_width: Numbers of a cell.
        heads: Of every attention.
        rows, columns: Cells along and across.
        bev: Whether there are cells at all; without, V_att is V_T with rays (ablation).
        history: Whether instants before the last one count (ablation).
    """

    width: int
    layers: int = 1
    bev_width: int = 96
    heads: int = 4
    rows: int = 10
    columns: int = 6
    bev: bool = True
    history: bool = True

    @property
    def grid(self) -> BevGrid:
        """The cells."""
        return BevGrid(rows=self.rows, columns=self.columns)


class CrossAttention(nn.Module):
    """Attention of queries to keys of another width, with an optional bias on the scores."""

    def __init__(self, queries: int, keys: int, inner: int, heads: int) -> None:
        """Args: numbers of a query, of a key, of all heads together, and heads."""
        super().__init__()
        self.heads = heads
        self.q, self.out = nn.Linear(queries, inner), nn.Linear(inner, queries)
        self.k, self.v = nn.Linear(keys, inner), nn.Linear(keys, inner)
        self.before_q, self.before_k = nn.LayerNorm(queries), nn.LayerNorm(keys)

    def forward(self, queries: torch.Tensor, keys: torch.Tensor, bias: torch.Tensor | None = None) -> torch.Tensor:
        """(B, N, queries), (B, M, keys), bias (N, M), (B, N, M) or none, to (B, N, queries)."""
        batch = queries.shape[0]
        normed = self.before_k(keys)

        def split(x: torch.Tensor) -> torch.Tensor:
            return x.view(batch, x.shape[1], self.heads, -1).transpose(1, 2)

        q, k, v = split(self.q(self.before_q(queries))), split(self.k(normed)), split(self.v(normed))
        mask = None if bias is None else bias.to(q.dtype)
        if mask is not None and mask.dim() == 3:
            mask = mask[:, None]
        mixed = nn.functional.scaled_dot_product_attention(q, k, v, attn_mask=mask)
        return self.out(mixed.transpose(1, 2).reshape(batch, queries.shape[1], -1))


class BevFusion(nn.Module):
    """Eq. 9 and 10 over the views of several instants."""

    def __init__(self, config: FusionConfig) -> None:
        """Args: its shape."""
        super().__init__()
        self.config = config
        width, bev = config.width, config.bev_width
        self.ray = nn.Sequential(nn.Linear(6, width), nn.GELU(), nn.Linear(width, width))
        self.motion = nn.Linear(3, bev)
        if not config.bev:
            return
        self.queries = nn.Parameter(torch.randn(config.grid.cells, bev) * 0.02)
        self.place = nn.Sequential(nn.Linear(2, bev), nn.GELU(), nn.Linear(bev, bev))
        self.tsa = CrossAttention(bev, bev, bev, config.heads)
        self.sca = CrossAttention(bev, width, bev, config.heads)
        self.mix = nn.Sequential(nn.LayerNorm(bev), nn.Linear(bev, 2 * bev), nn.GELU(), nn.Linear(2 * bev, bev))
        self.sharpness = nn.Parameter(torch.zeros(()))
        self.project = nn.Linear(bev, bev)
        self.sfa = CrossAttention(width, bev, width, config.heads)

    def start_silent(self) -> None:
        """Have V_att be V_T at first, so that a pretrained model is what it was until the fusion has learned."""
        for module in (self.ray[2], *([self.sfa.out] if self.config.bev else [])):
            for parameter in module.parameters():
                nn.init.zeros_(parameter)

    def forward(
        self,
        now: torch.Tensor,
        past: torch.Tensor,
        rig: tuple[torch.Tensor, ...],
        motion: torch.Tensor,
        bev: bool = True,
    ) -> tuple[torch.Tensor, torch.Tensor | None]:
        """Fuse.

        Args:
            now: Features of every patch at the last instant, (B, M, layers * width); M is views * patches.
            past: Of the instants before, oldest first, (B, T - 1, K, layers * width): of the first K of those patches.
            rig: `rays`, `bias` and `places` of RigGeometry as tensors; the first two with a row a scene, where rigs
                differ.
            motion: How the ego has moved since the instant before, (B, T, 3): forward and leftward, in tens of metres,
                and turned, rad; it shifts what the cells remember.
            bev: Whether the cells are used, where there are any.

        Returns:
            V_att at the last instant, (B, M, layers * width), and the cells, (B, cells, bev_width); None without cells.
        """
        rays, _, _ = rig
        parts = list(now.split(self.config.width, dim=-1))
        rayed = self.ray(rays[..., : now.shape[1], :])
        if not (bev and self.config.bev):
            return torch.cat([part + rayed for part in parts], dim=-1), None
        cells = self.cells(now, past, rig, motion)
        projected = self.project(cells)
        return torch.cat([self.sfa(part + rayed, projected) + part + rayed for part in parts], dim=-1), cells

    def cells(
        self, now: torch.Tensor, past: torch.Tensor, rig: tuple[torch.Tensor, ...], motion: torch.Tensor
    ) -> torch.Tensor:
        """B at the last instant (Eq. 9), (B, cells, bev_width); arguments as in `forward`."""
        rays, bias, places = rig
        query = (self.queries + self.place(places)).expand(now.shape[0], -1, -1)
        cells = query
        seen = [*past.unbind(1), now] if self.config.history else [now]
        for instant, views in enumerate(seen, motion.shape[1] - len(seen)):
            before = cells + self.motion(motion[:, instant])[:, None]
            cells = self.tsa(query, torch.cat([query, before], dim=1)) + before
            patches = views.shape[1]
            shown = views[:, :, : self.config.width] + self.ray(rays[..., :patches, :])
            cells = cells + self.sca(cells, shown, bias[..., :patches] * self.sharpness.exp())
            cells = cells + self.mix(cells)
        return cells


def rig_tensors(rig: RigGeometry) -> tuple[torch.Tensor, ...]:
    """A rig's geometry as `BevFusion.forward` takes it."""
    return torch.from_numpy(rig.rays), torch.from_numpy(rig.bias), torch.from_numpy(rig.places)
