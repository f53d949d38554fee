"""The split god-object: the mean of several surface points that are about equally near."""
