"""Attributes that describe how difficult a sequence is, measured from pixels and ground truth.

>>> from trackmark.datasets.attributes import names
>>> names()[:3]
['size', 'scale_change', 'aspect_change']
"""

from trackmark.datasets.attributes.attribute import Attribute
from trackmark.datasets.attributes.measuring import cached_values, find, measure, names, overall

__all__ = ["Attribute", "cached_values", "find", "measure", "names", "overall"]
