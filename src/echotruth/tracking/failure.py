"""What a tracker raises that found no motion."""


class TrackerFailed(ValueError):
    """A tracker that gave no answer, or none that can be used; the message says why in one sentence."""
