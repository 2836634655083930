"""The loop model: bodies, ends and equations of loops, exact, numeric and of variable geometry."""
