"""Failure of a case: its group says why, and the other cases go on."""


class CaseFailed(ValueError):
    """Raised by a stage if the heart of a case has no result."""
