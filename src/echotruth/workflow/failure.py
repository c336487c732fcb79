"""Failure of a case: its job records the reason in the ledger, from where it comes to `cases/reason`."""


class CaseFailed(ValueError):
    """A case has no solution; the failure is recorded and the other cases continue."""
