"""Statistics of studies: psychometric functions, Bradley–Terry scores, intervals, scores."""
