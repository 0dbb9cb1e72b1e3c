"""The node and its services: the only code of the twin that knows ROS."""
