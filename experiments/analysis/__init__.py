"""What experiments compute beyond the package: fits, convergence, participation, reduced models for studies."""
