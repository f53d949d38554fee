"""B-spline textures: coefficients, samplers and searches."""
