"""Stand-ins of operating systems; see ``other_systems.py``."""
