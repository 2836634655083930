"""A package of ROS 2 with a kinematics plugin of MoveIt 2 over the generated C."""
