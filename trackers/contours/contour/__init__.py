"""Contours: outlines of masks, sums over what they enclose, and snakes that fit them to edges."""
