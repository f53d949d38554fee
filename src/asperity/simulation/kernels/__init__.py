"""Plain functions that are compiled into the servo loop: how a body moves over one sample."""
