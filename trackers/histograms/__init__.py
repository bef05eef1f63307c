"""What colour histograms do.

`bins` of colours are counted in `rectangles` and `ellipses` by whichever way `counting` finds the
cheapest; `mean_shift` follows a histogram; `target_model` and `motion` are the elliptic particle
filter's.
"""
