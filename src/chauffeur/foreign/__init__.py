"""Readers of what comes from outside: a model's words, the numbers in them, and the bodies of HTTP answers."""
