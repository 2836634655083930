"""C for single poses, batches on vector lanes and parallel branches."""
