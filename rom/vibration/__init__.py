"""Modal analysis of the fingertip: what its modes look like, how it answers to vibration, what decides either."""
