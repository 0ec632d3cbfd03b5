"""The estimator as it runs on the vehicle. Imports nothing else of this project."""
