"""From what a tracker saw to the parameters of the heart: observation, error of trackers, prior and posterior."""
