"""The on-board language model: a passenger's wish in, a short program of driving skills out."""
