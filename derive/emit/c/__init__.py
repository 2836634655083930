"""Generates C for single poses, batches of poses and parallel branches."""
