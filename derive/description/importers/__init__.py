"""Importers for the files of other programs, which are URDF, xacro, SRDF, MJCF and calibrations."""
