"""The vehicle's equations, their propagation over a recording, and its sensitivities."""
