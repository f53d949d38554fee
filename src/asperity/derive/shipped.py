"""Where the generated files of the shipped laws lie."""

from __future__ import annotations

from pathlib import Path

from asperity.laws import Law

GENERATED = Path(__file__).parent / "generated"


def generated_path(law: Law) -> Path:
    """Return where the kernels of a shipped law lie."""
    return GENERATED / f"law_{law.letter.lower()}.py"
