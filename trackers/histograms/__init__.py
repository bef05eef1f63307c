"""Colour histograms of image regions, and tracking by them.

`bins` defines colour bins. `rectangles` and `ellipses` count them in regions; `counting` selects
the fastest way. `mean_shift` tracks a histogram. `target_model` and `motion` are parts of the
elliptic particle filter `nummiaro2003`.
"""
