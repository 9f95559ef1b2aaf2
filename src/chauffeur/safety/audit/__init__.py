"""The audit log: what was wished, planned, judged, prevented and done, in a chain that shows tampering."""

from chauffeur.safety.audit.entries import FORMAT, KINDS, AuditRecord, Kind
from chauffeur.safety.audit.heads import head_path
from chauffeur.safety.audit.keys import key_name, read_key
from chauffeur.safety.audit.reader import read_records
from chauffeur.safety.audit.redaction import Redaction, redact
from chauffeur.safety.audit.texts import says, words_of
from chauffeur.safety.audit.verification import AuditFinding, AuditVerification, verify, verify_stream
from chauffeur.safety.audit.writer import AuditLog, Closing

__all__ = [
    "FORMAT",
    "KINDS",
    "AuditFinding",
    "AuditLog",
    "AuditRecord",
    "AuditVerification",
    "Closing",
    "Kind",
    "Redaction",
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
