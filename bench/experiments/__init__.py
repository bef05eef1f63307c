"""Experiment files, and trackers with validated parameters and a version."""
