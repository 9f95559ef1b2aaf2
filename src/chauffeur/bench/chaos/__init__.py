"""Fault injection: drives in real time whose model, processes, memory, disk and clock fail, judged by what control did.

Every case drives a trip in the real processes (`drive/live`), asks one to three wishes, and breaks something from the
outside at a drawn moment. Nothing in the product knows of it: signals, a server that misbehaves, another process that
writes into the shared memory, limits of the operating system, a clock that jumps.
"""

from chauffeur.bench.chaos.cases import KINDS, ChaosCase, FaultKind, draw

__all__ = ["KINDS", "ChaosCase", "FaultKind", "draw"]
