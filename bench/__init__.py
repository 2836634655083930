"""Speed and size of chasles, always beside a peer measured in the same run."""
