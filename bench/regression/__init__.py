"""Accuracy and time of trackers against a stored baseline or another revision."""
