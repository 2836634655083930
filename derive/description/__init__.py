"""Readers of robot files and URDF, and their modeling conventions."""
