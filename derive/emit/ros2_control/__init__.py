"""Converts between actuators and joints for ros2_control."""
