"""Pages and figures of the reproduced paper."""
