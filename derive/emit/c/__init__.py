"""Generates C for single poses, for batches of poses on SIMD lanes, and for parallel branches."""
