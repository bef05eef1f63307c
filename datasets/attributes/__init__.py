"""Attributes that describe how difficult a sequence is, measured from pixels and ground truth.

>>> from trackmark.datasets.attributes import ATTRIBUTES
>>> list(ATTRIBUTES)[:3]
['size', 'scale_change', 'aspect_change']
"""

from trackmark.datasets.attributes.attribute import Attribute
from trackmark.datasets.attributes.measuring import ATTRIBUTES, cached_values, measure, overall

__all__ = ["ATTRIBUTES", "Attribute", "cached_values", "measure", "overall"]
