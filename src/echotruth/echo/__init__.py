"""One's own echo: a recorded clip and the wall that was drawn in it, tracked for strain. There is no truth."""
