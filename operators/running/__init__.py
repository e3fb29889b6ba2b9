"""Jobs, stages, the cache of results, and the base classes of operators."""
