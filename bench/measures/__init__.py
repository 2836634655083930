"""One module for each benchmark; each exports `run(plan)`."""
