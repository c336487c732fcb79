"""Motion of a heart read from files: a series of meshes, or of positions of the nodes of one mesh."""
