"""Every tolerance of the compiler: name, value, unit and reason, by the room that uses it.

Lengths are told in parts of the robot's characteristic length where nothing else is said. A number
that a formula needs for other reasons (a count of steps, a size of a page) is no tolerance and
stays where it is used.
"""

# --- description: what a file rounds ---

# --- terms, chain: numbers that are integers ---

# --- loops: closures, ranks, branches ---

# --- inverse: structures, boundaries of subproblems, eigenvalues ---

# --- latex: what a reader need not see ---
