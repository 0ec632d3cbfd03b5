"""Reproduction of Yuan et al., J. Mar. Sci. Eng. 2025, 13, 1489: its tables, figures and errata, "
"recomputed."""
