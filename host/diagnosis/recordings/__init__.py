"""What of the recordings teaches, what only judges, and what says nothing."""
