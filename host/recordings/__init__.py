"""Recordings before any model: read, put on the time grid, rid of what is no motion."""
