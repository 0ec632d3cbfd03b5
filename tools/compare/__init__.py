"""Other identification packages and ours: the same data to learn from, the same free run to pass."""
