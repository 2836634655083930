"""Importers for the files of other programs: URDF, xacro, SRDF, MJCF and calibrations."""
