"""Generates C for single poses, for batches on SIMD lanes, and for parallel branches."""
