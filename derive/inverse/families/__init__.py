"""The families of chains that have a closed-form inverse, one file of numbered steps each.

A family is a module with ``requires(lines)``, the conditions on the axes with how far they are from
holding, and ``solve(work, lines, target)``.
"""
