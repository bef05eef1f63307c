"""The paper's method in plain NumPy, equation by equation, without any special optimisation.

It is written down from the text and not from the tracker's code, with which it shares nothing:
boxes and events must be the same.
"""

from bench.papers.nguyen2002.plain.offline import track_offline
from bench.papers.nguyen2002.plain.settings import Settings
from bench.papers.nguyen2002.plain.tracker import PlainNguyen2002

__all__ = ["PlainNguyen2002", "Settings", "track_offline"]
