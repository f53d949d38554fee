"""The page of a result, and how terminal, notebook and HTML show it."""
