"""Wishes for a real vehicle: planned, checked, written down, asked of the vehicle, confirmed, remembered."""
