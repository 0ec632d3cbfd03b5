"""What an explanation is worth: score, deviations, verdict, and where the mismatch is."""
