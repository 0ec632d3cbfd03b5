"""Where simulation and recording differ, what physics was left out, and proof that it was that."""
