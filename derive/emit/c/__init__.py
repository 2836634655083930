"""The C of a robot: single poses, batches on vector lanes, branches side by side."""
