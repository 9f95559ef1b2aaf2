"""One judge of drives: acts of an utterance, held against the geometry of what was driven."""
