"""The benchmark: trackers by condition on the test hearts of repositories, submissions with their cards, and checks."""
