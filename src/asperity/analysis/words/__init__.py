"""From values to the sentences that results carry."""
