"""Fits of sets of effects: where they begin, what they are charged, gain and leave."""
