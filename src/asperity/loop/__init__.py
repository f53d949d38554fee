"""The compiled servo loop, with its parts: clock, device, guards and trace."""
