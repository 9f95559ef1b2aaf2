"""LaMPilot-Bench: instruction following on highway and intersection (seed Sec. IV-A)."""
