"""Exception of a tracker that found no motion."""


class TrackerFailed(ValueError):
    """Raised if a tracker gives no result, or an invalid one; the message says why in one sentence."""
