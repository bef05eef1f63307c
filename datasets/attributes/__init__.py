"""What may make a sequence hard, computed from its pixels and its truth; kept once computed.

>>> from trackmark.datasets.attributes import names
>>> names()[:3]
['size', 'scale_change', 'aspect_change']
"""

from trackmark.datasets.attributes.attribute import Attribute
from trackmark.datasets.attributes.measuring import kept, measured, names, of_name, overall

__all__ = ["Attribute", "kept", "measured", "names", "of_name", "overall"]
