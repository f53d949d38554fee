"""Sentences of the results: verdicts, reasons, recommendations and assumptions."""
