"""The compiled loop of a device, and what it asks of clocks and devices."""
