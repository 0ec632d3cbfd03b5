"""Bytes, frames and log files to measurements in SI units, and back. Imports nothing else of this project."""
