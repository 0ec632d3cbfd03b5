"""An identified vehicle: its model, how well it is known, its free runs, its report."""
