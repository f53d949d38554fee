"""Tell TIFF files of instruments, which hold calibrated heights, from plain pictures."""

from __future__ import annotations

import io
from typing import Any

from asperity.measured.reading.quiet import quiet_log

_PARK = 50432
_JPK = range(0x8000, 0x8100)
_LEXT = "TiffTagDescData"


def is_instrument_tiff(content: bytes) -> bool:
    """True for the TIFF variants of Park Systems, JPK and Olympus LEXT.

    Their tags: 50432 (Park), 0x8000 to 0x80FF (JPK), an XML image description (LEXT).

    Args:
        content: the bytes of a TIFF.
    """
    import tifffile

    try:
        with quiet_log("tifffile"), tifffile.TiffFile(io.BytesIO(content)) as file:
            pages: list[Any] = list(file.pages)[:8]
            for page in pages:
                codes = {int(tag.code) for tag in page.tags}
                if _PARK in codes or len(codes.intersection(_JPK)) > 2:
                    return True
                if _LEXT in str(page.description)[:100_000]:
                    return True
    except Exception:  # a damaged file is refused by whoever reads it
        return False
    return False
