"""Robots with loops: equations, closed-form solution, assembly modes, joint rates and mobility.

Robots without loops use :mod:`chasles.derive.chain` instead.
"""
