"""hoz-dist: distributed A3C for object-goal navigation guided by hierarchical object-to-zone graphs."""

__version__ = "0.1.0"
