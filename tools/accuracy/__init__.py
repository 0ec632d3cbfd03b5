"""Accuracy of every method on identical data, with a generator and a Cramér-Rao bound of its own."""
