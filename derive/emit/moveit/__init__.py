"""A ROS 2 package with a kinematics plugin for MoveIt 2 that calls the generated C."""
