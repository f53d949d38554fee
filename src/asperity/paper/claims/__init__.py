"""The paper's claims, one module per section."""
