"""Calibration of drawn arms, and of simulated sets of a laser tracker."""
