"""Functions of q and p for loops with variable geometry."""
