"""What a device sets as limits to a texture."""
