"""Draw the picture of the README: ``python docs/make_picture.py``."""

from pathlib import Path

import asperity as asp
from asperity.report import plot

TEXTURE = asp.Sinusoid(amplitude=0.4e-3, period=1.5e-3)


def main() -> None:
    """Write docs/_static/fields.png: the force of four laws over its curl."""
    result = asp.compare(TEXTURE, laws="ACDH")
    figure = plot(result, picture="field")
    figure.savefig(Path(__file__).parent / "_static" / "fields.png", dpi=110)


if __name__ == "__main__":
    main()
