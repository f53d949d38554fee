"""How much a law raises the loop gain: characteristic, one-sided and curl number."""
