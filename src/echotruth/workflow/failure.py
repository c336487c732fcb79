"""Failure of a case: its job records the reason in the ledger, and publication copies it to `cases/reason`.

Errors of the mechanics become failures in workflow/scripts/mechanics.py.
"""


class CaseFailed(ValueError):
    """Raised if a case has no solution; the failure is recorded and the other cases continue."""
