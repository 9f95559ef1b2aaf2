"""The parser of meaning: sentences composed from banks of phrases, the network, its training and export."""
