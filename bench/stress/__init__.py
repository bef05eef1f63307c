"""Levels of difficulty at which trackers lose the target."""
