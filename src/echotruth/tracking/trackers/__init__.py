"""The trackers, one module a method; each has a function `track`."""
