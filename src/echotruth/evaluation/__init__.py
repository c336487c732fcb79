"""How far tracked motion is from the truth: displacement, strain, statistics and the leaderboard."""
