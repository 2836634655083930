"""Conversion of robots to robot files, URDF, and tables of joint parameters."""
