"""What colour histograms do: counting, distances, mean shift, elliptic regions."""
