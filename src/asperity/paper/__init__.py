"""The paper as runnable code: each of its claims computed, and the data of its figures."""

from asperity.paper.claim import VERDICTS, Claim, Evidence, Result, Verdict
from asperity.paper.claims import CLAIMS, get_claim, reproduce_claims

__all__ = [
    "CLAIMS",
    "VERDICTS",
    "Claim",
    "Evidence",
    "Result",
    "Verdict",
    "get_claim",
    "reproduce_claims",
]
