"""The trackers: one module per method, each with a function `track`."""
