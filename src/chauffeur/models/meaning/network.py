"""The parser: a sentence encoder, and a small decoder that writes symbols and points at tokens of the text."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor, nn

from chauffeur.language.meaning.symbols import INDEX, MOST_SYMBOLS, POINTER, SYMBOLS


@dataclass(frozen=True)
class ParserConfig:
    """Sizes.

    Attributes:
        width: Of encoder and decoder.
        layers: Of the decoder.
        heads: Of the decoder.
        dropout: In the decoder, while training.
    """

    width: int = 384
    layers: int = 2
    heads: int = 6
    dropout: float = 0.1


class MeaningParser(nn.Module):
    """Encoder of `transformers`' BERT kind, and a decoder over `SYMBOLS` and the positions of the text.

    A pointer is written as the symbol `POINTER` with a position: it is embedded as the memory at that position, and
    scored by a dot product with it.
    """

    def __init__(self, encoder: Any, config: ParserConfig) -> None:
        """Args: the encoder, its sizes."""
        super().__init__()
        self.config, self.encoder = config, encoder
        width = config.width
        self.symbols = nn.Embedding(len(SYMBOLS), width)
        self.places = nn.Embedding(MOST_SYMBOLS + 1, width)
        nn.init.normal_(self.symbols.weight, std=0.05)
        nn.init.normal_(self.places.weight, std=0.05)
        layer = nn.TransformerDecoderLayer(
            width, config.heads, 4 * width, config.dropout, "gelu", batch_first=True, norm_first=True
        )
        self.decoder = nn.TransformerDecoder(layer, config.layers, norm=nn.LayerNorm(width))
        self.out = nn.Linear(width, len(SYMBOLS))
        self.point_from = nn.Linear(width, width)
        self.point_to = nn.Linear(width, width)
        self.pointed = nn.Linear(width, width)

    def encode(self, ids: Tensor, mask: Tensor) -> Tensor:
        """Memory of texts, (batch, tokens, width)."""
        return self.encoder(input_ids=ids, attention_mask=mask).last_hidden_state

    def _layers(self, hidden: Tensor, memory: Tensor, later: Tensor, padded: Tensor) -> Tensor:
        """The decoder's layers one by one: the module's own loop looks at the mask's values, which no graph can."""
        for layer in self.decoder.layers:
            held: Any = layer
            inner = held.norm1(hidden)
            hidden = hidden + held.dropout1(held.self_attn(inner, inner, inner, attn_mask=later, need_weights=False)[0])
            inner = held.norm2(hidden)
            hidden = hidden + held.dropout2(
                held.multihead_attn(inner, memory, memory, key_padding_mask=padded, need_weights=False)[0]
            )
            inner = held.linear2(held.dropout(held.activation(held.linear1(held.norm3(hidden)))))
            hidden = hidden + held.dropout3(inner)
        return self.decoder.norm(hidden)  # type: ignore[misc]

    def decode(self, written: Tensor, positions: Tensor, memory: Tensor, mask: Tensor) -> Tensor:
        """Scores of what comes next, (batch, length, symbols + tokens).

        Args:
            written: Ids of symbols, (batch, length); `POINTER` where one points.
            positions: Tokens pointed at, (batch, length); 0 elsewhere.
            memory, mask: Of the texts.
        """
        length, width = written.shape[1], memory.shape[-1]
        at = positions.unsqueeze(-1).expand(-1, -1, width)
        pointed = self.pointed(memory.gather(1, at)) * (written == INDEX[POINTER]).unsqueeze(-1)
        hidden = self.symbols(written) + pointed + self.places.weight[:length]
        later = torch.ones(length, length, dtype=torch.bool, device=written.device).triu(1)
        hidden = self._layers(hidden, memory, later, mask == 0)
        pointers = self.point_from(hidden) @ self.point_to(memory).transpose(1, 2) / width**0.5
        pointers = pointers.masked_fill((mask == 0).unsqueeze(1), -1e4)
        return torch.cat([self.out(hidden), pointers.to(hidden.dtype)], -1)
