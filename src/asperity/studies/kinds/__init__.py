"""The kinds of methods: what is presented when, and what the answers say."""
