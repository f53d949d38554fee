"""Views of simulated and real servo loops."""
