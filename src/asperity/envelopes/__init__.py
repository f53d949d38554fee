"""Which textures a device renders, and the texture that meets a target."""
