"""The twin's node and services: the only code of the twin that depends on ROS."""
