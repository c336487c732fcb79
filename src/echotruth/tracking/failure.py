"""Exception of a tracker that found no motion."""


class TrackerFailed(ValueError):
    """A tracker gave no result, or an invalid one; the message says why in one sentence."""
