"""The split god-object: the mean of several surface points at about equal distance."""
