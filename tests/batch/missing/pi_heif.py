"""Stands in the way of the package that reads HEIC."""

raise ImportError("hidden for a test")
