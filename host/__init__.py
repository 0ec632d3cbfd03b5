"""Vehicle configuration, alignment, live loop, bench identification and reports."""
