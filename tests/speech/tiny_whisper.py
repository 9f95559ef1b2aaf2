"""A Whisper model in the format that faster-whisper loads, whose weights make it say one sentence to any sound.

Its layers add nothing; the position of a token alone decides which one comes next. It runs through the whole of
CTranslate2 and faster-whisper, and understands nothing.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

SPECIAL = (
    "<|endoftext|>", "<|startoftranscript|>", "<|en|>", "<|translate|>", "<|transcribe|>", "<|startoflm|>",
    "<|startofprev|>", "<|nospeech|>", "<|notimestamps|>",
)  # fmt: skip
WIDTH = 64


def make(folder: Path, says: str, after: int, rng: np.random.Generator, sure: float = 3.0) -> Path:
    """Write the model; needs ctranslate2 and tokenizers.

    Args:
        folder: New folder.
        says: What it says, fewer letters than `WIDTH`, without blanks: the library takes those for noise here.
            No letter twice in a row: on processors whose 8-bit products saturate, those get uncertain.
        after: Number of tokens before its answer.
        rng: Weights that do not matter.
        sure: Scale of its certainty; below 1 it hesitates.
    """
    from ctranslate2.specs import WhisperSpec
    from tokenizers import Tokenizer, decoders, models, pre_tokenizers

    letters = sorted(pre_tokenizers.ByteLevel.alphabet())
    tokenizer = Tokenizer(models.BPE(vocab={letter: k for k, letter in enumerate(letters)}, merges=[]))
    tokenizer.pre_tokenizer = pre_tokenizers.ByteLevel(add_prefix_space=False)
    tokenizer.decoder = decoders.ByteLevel()
    tokens = [*letters, *SPECIAL, *(f"<|{0.02 * k:.2f}|>" for k in range(1501))]
    answer = [*tokenizer.encode(says).ids, tokens.index(SPECIAL[0])]
    tokenizer.add_special_tokens(list(SPECIAL))

    def some(*shape: int) -> np.ndarray:
        return rng.normal(0.0, 0.05, shape).astype(np.float32)

    def norm(spec, gain: float = 1.0) -> None:
        spec.gamma, spec.beta = np.full(WIDTH, gain, np.float32), np.zeros(WIDTH, np.float32)

    def linear(spec, out: int, wide: int, zero: bool = False) -> None:
        spec.weight = np.zeros((out, wide), np.float32) if zero else some(out, wide)
        spec.bias = np.zeros(out, np.float32)

    def attention(spec, shapes: tuple[int, ...]) -> None:
        norm(spec.layer_norm)
        for one, out in zip(spec.linear, shapes, strict=True):
            linear(one, out, WIDTH, zero=one is spec.linear[-1])

    def feed_forward(spec) -> None:
        norm(spec.layer_norm)
        linear(spec.linear_0, 2 * WIDTH, WIDTH)
        linear(spec.linear_1, WIDTH, 2 * WIDTH, zero=True)

    spec = WhisperSpec(1, 2, 1, 2)
    encoder, decoder = spec.encoder, spec.decoder
    encoder.conv1.weight, encoder.conv1.bias = some(WIDTH, 80, 3), some(WIDTH)
    encoder.conv2.weight, encoder.conv2.bias = some(WIDTH, WIDTH, 3), some(WIDTH)
    encoder.position_encodings.encodings = some(1500, WIDTH)
    norm(encoder.layer_norm)
    attention(encoder.layer[0].self_attention, (3 * WIDTH, WIDTH))
    feed_forward(encoder.layer[0].ffn)
    decoder.embeddings.weight = np.zeros((len(tokens), WIDTH), np.float32)
    # Position p is the unit vector p mod WIDTH; the projection turns it into the token that comes next.
    decoder.position_encodings.encodings = np.eye(WIDTH, dtype=np.float32)[np.arange(448) % WIDTH]
    norm(decoder.layer_norm)
    attention(decoder.layer[0].self_attention, (3 * WIDTH, WIDTH))
    attention(decoder.layer[0].attention, (WIDTH, 2 * WIDTH, WIDTH))
    feed_forward(decoder.layer[0].ffn)
    projection = np.zeros((len(tokens), WIDTH), np.float32)
    for k, token in enumerate(answer):
        projection[token, (after - 1 + k) % WIDTH] = sure
    decoder.projection.weight = projection
    spec.register_vocabulary(tokens)
    spec.config.suppress_ids, spec.config.suppress_ids_begin = [], []
    spec.config.lang_ids, spec.config.alignment_heads = [tokens.index("<|en|>")], [(0, 0), (0, 1)]
    spec.validate()
    spec.optimize()
    folder.mkdir()
    spec.save(str(folder))
    tokenizer.save(str(folder / "tokenizer.json"))
    return folder
