"""A session of a study: stimuli, loop, screens, and the page."""
