"""What scatters: the wall, the blood and the surroundings, and how they change from frame to frame."""
