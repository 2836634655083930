"""The arms and robots that are measured, their poses, and the tasks of their inverses."""
