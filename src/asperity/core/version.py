"""The version of the package, which pyproject.toml reads here, and the group of its plugins."""

__version__ = "1.0.0rc1"
PLUGIN_GROUP = "asperity.plugins"
"""Group of the entry points by which installed packages declare plugins."""
