"""What is told of a diagnosis: its files, its page, its pictures."""
