"""Results as sentences, and numbers as text: the same in the terminal, on the page, in pictures."""
