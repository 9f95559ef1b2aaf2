"""A person at the wheel: a page on this machine, keys in, commands out, scored like every other method."""
