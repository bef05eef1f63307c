"""Figure and ground: planes, mixtures and contours as cues of a chain, and what learns of them."""
