"""Pages of results, a file for each kind of result."""
