"""What is said if something cannot be exported."""


class ExportError(ValueError):
    """Raised if something cannot be exported; the message says why, and what to do."""
