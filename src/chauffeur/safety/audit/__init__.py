"""The audit log: what was wished, planned, judged, prevented and done, in a chain that shows tampering."""

from chauffeur.safety.audit.entries import KINDS, AuditRecord, Kind
from chauffeur.safety.audit.heads import head_path
from chauffeur.safety.audit.keys import read_key
from chauffeur.safety.audit.reader import read_records
from chauffeur.safety.audit.redaction import redact
from chauffeur.safety.audit.texts import says, words_of
from chauffeur.safety.audit.verification import AuditVerification, verify, verify_stream
from chauffeur.safety.audit.writer import AuditLog, Closing

__all__ = [
    "KINDS",
    "AuditLog",
    "AuditRecord",
    "AuditVerification",
    "Closing",
    "Kind",
    "head_path",
    "read_key",
    "read_records",
    "redact",
    "says",
    "verify",
    "verify_stream",
    "words_of",
]
