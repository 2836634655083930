"""Tool measurements: positions, poses, distances, device frames, and measurement tables."""
