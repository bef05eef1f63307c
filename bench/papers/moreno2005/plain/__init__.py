"""The paper's method in plain NumPy, section by section, without any special optimisation.

It is written down from the text and not from the trackers' code, with which it shares nothing but
their parameters: contours and posteriors must be the same. By agreement, as the text is silent,
these are the same too: the order of the random numbers, and the constants that have no parameter.
Contours whose place is a Kalman filter's are not here, nor are other answers than the snake's.
"""

from bench.papers.moreno2005.plain.contour_smooth_colour import PlainContourSmoothColor
from bench.papers.moreno2005.plain.moreno2005 import PlainMoreno2005

__all__ = ["PlainContourSmoothColor", "PlainMoreno2005"]
