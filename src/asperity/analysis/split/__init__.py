"""Law H beyond its force: the state of the split god-object, and pop-through of thin plates."""
