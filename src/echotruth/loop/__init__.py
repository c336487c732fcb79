"""The pressure-volume loop that drives the heart: read, checked, scaled and sampled, and its phases."""
