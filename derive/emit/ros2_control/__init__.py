"""Conversions between the actuators and the joints of a robot, with an example for ros2_control."""
