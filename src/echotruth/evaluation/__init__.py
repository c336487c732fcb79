"""Comparison of tracked motion with the truth: displacement, strain, statistics and the leaderboard."""
