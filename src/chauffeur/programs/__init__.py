"""The language of language-model programs: catalogue of driving APIs, static gate, sandbox and executor."""

from chauffeur.programs.binding import DrivingApis, starting_setpoints
from chauffeur.programs.catalogue import APIS, CATALOGUE, Api, Param, render_docs
from chauffeur.programs.errors import (
    ProgramCallsError,
    ProgramCrashError,
    ProgramFaultError,
    ProgramMemoryError,
    ProgramRaisedError,
    ProgramRecursionError,
    ProgramRefusedError,
    ProgramSyntaxError,
    ProgramTimeError,
)
from chauffeur.programs.executor import ProgramExecutor, TickResult
from chauffeur.programs.extract import Extracted, extract_program
from chauffeur.programs.findings import Finding
from chauffeur.programs.gate import GateReport, check_source
from chauffeur.programs.sandbox import UNHURRIED, Budget, Sandbox

__all__ = [
    "APIS",
    "CATALOGUE",
    "UNHURRIED",
    "Api",
    "Budget",
    "DrivingApis",
    "Extracted",
    "Finding",
    "GateReport",
    "Param",
    "ProgramCallsError",
    "ProgramCrashError",
    "ProgramExecutor",
    "ProgramFaultError",
    "ProgramMemoryError",
    "ProgramRaisedError",
    "ProgramRecursionError",
    "ProgramRefusedError",
    "ProgramSyntaxError",
    "ProgramTimeError",
    "Sandbox",
    "TickResult",
    "check_source",
    "extract_program",
    "render_docs",
    "starting_setpoints",
]
