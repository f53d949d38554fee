"""Devices that stand in for those of vendors, and fail as they are ordered."""
