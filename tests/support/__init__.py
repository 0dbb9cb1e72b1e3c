"""What the tests share: ROS domains, processes, a ROS peer, and messages."""
