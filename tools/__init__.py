"""The `mils` command, the simulated vehicle, benchmarks and the paper's reproduction."""
