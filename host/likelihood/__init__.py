"""The likelihood of recordings under each kind of noise, and the way to its maximum."""
