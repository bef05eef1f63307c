"""Colour histograms of regions: bins, exact counts, and distances between them."""
