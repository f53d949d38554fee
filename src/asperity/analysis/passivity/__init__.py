"""What each criterion says of a law on a device."""
