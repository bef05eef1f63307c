"""Result formats, one per module."""
