"""Importer for MJCF, the model format of MuJoCo."""
