"""Failure of a case: its job records the reason in the ledger, and publication copies it to `cases/reason`.

Errors of the mechanics become failures in workflow/scripts/mechanics.py, and :func:`.job.run` records them. A heart
outside the bounds of `physiology` has not failed but is implausible: :mod:`echotruth.repository.verdict`.
"""


class CaseFailed(ValueError):
    """Raised if a case has no solution; the failure is recorded and the other cases continue."""
