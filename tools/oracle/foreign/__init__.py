"""Piles made by an engine and a ray caster that are not Tsumu's: see ../foreign_piles.py."""
