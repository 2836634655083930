"""The relative position of a chain's axes, and the closed form that it allows."""
