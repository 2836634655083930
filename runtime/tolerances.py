"""Every tolerance of the runtime in Python: name, value, unit and reason, by the room that uses it.

Those of the solvers in C stand in ``numerics/_tolerances.h``, in the same form. Lengths are told in
parts of the robot's characteristic length where nothing else is said.
"""
