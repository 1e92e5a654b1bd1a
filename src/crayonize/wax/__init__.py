"""The wax: a sheet of rough paper, tips that rub strokes onto it, and the order in which they
do.
"""
