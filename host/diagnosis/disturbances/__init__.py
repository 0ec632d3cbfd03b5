"""Searches among waves, under random forces, and beside what drifts."""
