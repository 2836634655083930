"""Robots with loops: equations, closed forms, assembly modes, joint rates and mobility.

Robots without loops use ``chasles.derive.chain`` instead.
"""
