"""The web bridge of the lupin_twin greenhouse digital twin."""

__version__ = "0.1.0"
