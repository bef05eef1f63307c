"""Particle filtering: weighted samples of a state, moved, weighed, averaged and resampled."""
