"""Packages of well-known arms for chasles, one package per arm."""
