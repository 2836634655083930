"""Robots with loops: equations, closed-form solution, assembly modes, rates and mobility.

Robots without loops use :mod:`chasles.derive.chain` instead.
"""
