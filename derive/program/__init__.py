"""Programs that compute functions: sequences of assignments to typed variables."""
