"""Long work: jobs, stages, what is kept of it, and what all operators have in common."""
