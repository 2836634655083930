"""Functions of q and p through loops with variable geometry."""
