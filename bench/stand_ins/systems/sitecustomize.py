"""Python imports this file when it starts, if its folder is in ``PYTHONPATH``."""

import other_systems  # type: ignore[import-not-found]  # its folder is in the path

other_systems.install()
