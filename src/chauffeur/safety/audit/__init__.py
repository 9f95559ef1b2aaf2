"""The audit log: what was wished, planned, judged, prevented and done, in a chain that shows tampering."""

from chauffeur.safety.audit.entries import FORMAT, KINDS, Kind, Record
from chauffeur.safety.audit.heads import head_path
from chauffeur.safety.audit.keys import key_name, read_key
from chauffeur.safety.audit.reading import read_records
from chauffeur.safety.audit.redaction import Redaction, redact
from chauffeur.safety.audit.texts import says, words_of
from chauffeur.safety.audit.verification import Finding, Verification, verify, verify_stream
from chauffeur.safety.audit.writer import AuditLog, Closing

__all__ = [
    "FORMAT",
    "KINDS",
    "AuditLog",
    "Closing",
    "Finding",
    "Kind",
    "Record",
    "Redaction",
    "Verification",
    "head_path",
    "key_name",
    "read_key",
    "read_records",
    "redact",
    "says",
    "verify",
    "verify_stream",
    "words_of",
]
