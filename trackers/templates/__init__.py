"""Tracking by a template whose pixels are filtered, each by itself (Nguyen & Smeulders 2002)."""
