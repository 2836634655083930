"""Readers for robot files and URDF, and their modelling conventions."""
