"""The web bridge of the lupin_twin greenhouse digital twin."""
