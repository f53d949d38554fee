"""Law H beyond its force: its state, and its potential as a table."""
