"""Readers for robot files and URDF, and their modeling conventions."""
