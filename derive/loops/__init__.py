"""Robots with loops: their equations, closed-form solution, assembly modes, rates and mobility.

What a robot without loops is derived from stands outside, in the rooms that are used here.
"""
