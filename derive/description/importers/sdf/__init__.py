"""Importer for SDF, the model format of Gazebo and Drake."""
