"""Functions for notebooks: they do in memory what the workflow does in a repository."""
