"""``asperity warm``: what is compiled ahead is what a comparison loads."""

from __future__ import annotations

from pathlib import Path

import pytest

from asperity.cli import setup_commands as warm
from asperity.core import cache
from asperity.kernels import fuse
from asperity.laws import LAWS


def compiled() -> tuple[dict[Path, bytes], list[str]]:
    """Return what is kept after a run in which nothing is loaded yet, and what was said."""
    for loaded in (fuse._load_module, fuse.fuse_surface, fuse.fuse_sampler, fuse.fuse_contact):
        loaded.cache_clear()
    said: list[str] = []
    name = "sinusoids"
    warm.precompile((LAWS["W"],), {name: warm.sample_textures()[name]}, said.append)
    code = {
        one.path: one.path.read_bytes() for one in cache.list_entries() if one.namespace == "code"
    }
    return code, said


@pytest.mark.keeps_answers
def test_what_is_compiled_is_kept_and_not_compiled_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ASPERITY_CACHE_DIR", str(tmp_path))
    first, said = compiled()
    assert len(first) >= 3
    assert said == ["law W on sinusoids"]
    assert compiled()[0] == first
    for path in first:
        path.unlink()
    assert compiled()[0].keys() == first.keys()
    assert {one.namespace for one in cache.list_entries()} == {"code"}  # no answer is taken or kept


def test_there_is_a_texture_for_each_way_to_compute_heights() -> None:
    assert len({texture.sampler for texture in warm.sample_textures().values()}) == 5
