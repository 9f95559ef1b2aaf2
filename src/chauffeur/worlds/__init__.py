"""Places to drive in. Each world knows its simulator and nothing of language."""
