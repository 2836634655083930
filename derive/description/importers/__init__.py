"""Importers for files of other programs: URDF, xacro, SRDF, MJCF and calibrations."""
