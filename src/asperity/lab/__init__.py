"""The lab: a page in a browser on which a loop is watched and steered while it runs."""
