"""Radio-frequency data: the echoes of a medium between all pairs of elements of the array."""
