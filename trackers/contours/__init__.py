"""Contours, colour planes and mixtures, and the dependent cues made of them."""
