"""Sentences with their labels."""
