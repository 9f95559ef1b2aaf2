"""Parts of benchmarks/lampilot_speed.py."""
