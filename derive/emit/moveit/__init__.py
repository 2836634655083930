"""Writes a ROS 2 package with a kinematics plugin for MoveIt 2."""
