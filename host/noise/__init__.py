"""What is random in a recording: sensor noise, what drifts, the errors of a measured speed."""
