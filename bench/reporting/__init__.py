"""Stored results as tables and pictures: what `trackmark report` and `show` print and draw."""
