"""Radio-frequency data: the echoes of a medium between all pairs of elements, or between columns and rows."""
