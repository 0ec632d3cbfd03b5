"""Which sets of effects are tried, which grow from which, and what gives way."""
