"""Experiment files, and trackers with settled parameters and a version."""
