"""A model or a simulation that the user holds, set against the recording."""
