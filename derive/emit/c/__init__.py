"""Generates C for single poses, for batches on vector lanes, and for parallel branches."""
