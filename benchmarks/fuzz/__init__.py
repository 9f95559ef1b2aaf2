"""Coverage-guided fuzzing of what reads words, programs and files from outside: `run.py` drives it."""
