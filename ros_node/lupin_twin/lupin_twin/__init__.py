"""The lupin_twin greenhouse digital twin. Importing it, or its pure modules, loads no ROS."""
