"""Importers for the files of other programs."""
