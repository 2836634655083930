"""The loop model: bodies, ends and equations of loops; exact, numeric, with variable geometry."""
