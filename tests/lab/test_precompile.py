"""``asperity warm`` compiles the code that a comparison loads."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.helpers.fused_code import forget_fused_modules

from asperity.core import cache
from asperity.lab import precompile as warm
from asperity.laws import LAWS


def precompiled_code() -> tuple[dict[Path, bytes], list[str]]:
    """Return the cached code after a precompilation without loaded code, and its messages."""
    forget_fused_modules()
    messages: list[str] = []
    name = "sinusoids"
    warm.precompile((LAWS["W"],), {name: warm.sample_textures()[name]}, messages.append)
    code = {
        entry.path: entry.path.read_bytes()
        for entry in cache.list_entries()
        if entry.namespace == "code"
    }
    return code, messages


@pytest.mark.caches_results
def test_compiled_code_is_cached_and_reused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ASPERITY_CACHE_DIR", str(tmp_path))
    first, messages = precompiled_code()
    assert len(first) >= 3
    assert messages == ["law W on sinusoids"]
    assert precompiled_code()[0] == first
    for path in first:
        path.unlink()
    assert precompiled_code()[0].keys() == first.keys()
    assert {entry.namespace for entry in cache.list_entries()} == {
        "code"
    }  # no result is read or stored


def test_sample_textures_cover_every_sampler() -> None:
    # Profiles and maps share one.
    assert len({texture.sampler for texture in warm.sample_textures().values()}) == 4
