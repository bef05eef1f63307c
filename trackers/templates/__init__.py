"""Tracking by a template whose pixels are filtered, each by itself (Nguyen & Smeulders 2002).

`matching` finds where it fits, `appearance` filters its pixels, `occlusion` remembers what hid it.
"""
