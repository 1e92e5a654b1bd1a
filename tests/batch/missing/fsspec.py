"""Stands in the way of an extra package."""

raise ImportError("hidden for a test")
