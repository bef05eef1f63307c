"""Named sets of metrics, one per module."""
