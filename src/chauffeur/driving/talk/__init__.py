"""Talking with the car while it drives: what is said and typed, what becomes of it, what is remembered of it."""
