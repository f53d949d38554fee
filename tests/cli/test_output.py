"""Output paths: files, links, pipes, and paths that cannot be written."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from asperity.cli.output import Outputs, check_output, check_outputs, write_output
from asperity.core.errors import ParameterError
from asperity.report.document.page import Paragraph, terminal_page


def test_existing_file_is_replaced_without_temporary_files(tmp_path: Path) -> None:
    target = tmp_path / "real.html"
    target.write_text("old")
    check_output("html", str(target), force=True)
    write_output("html", str(target), "new")
    assert target.read_text() == "new"
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
@pytest.mark.parametrize("is_link", [False, True], ids=["pipe", "link to a pipe"])
def test_pipe_is_written_to_and_not_replaced(tmp_path: Path, is_link: bool) -> None:
    """An atomic replacement would put a file in the place of a device."""
    pipe = path = tmp_path / "pipe.html"
    os.mkfifo(pipe)
    if is_link:
        path = tmp_path / "link.html"
        path.symlink_to(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        check_output("html", str(path), force=True)
        write_output("html", str(path), "text")
        assert os.read(reader, 100) == b"text"
    finally:
        os.close(reader)
    assert pipe.is_fifo()
    assert path.is_symlink() == is_link


@pytest.mark.parametrize("exists", [True, False])
def test_link_to_a_file_is_followed(tmp_path: Path, exists: bool) -> None:
    (tmp_path / "far").mkdir()
    real, link = tmp_path / "far" / "real.html", tmp_path / "link.html"
    if exists:
        real.write_text("old")
    link.symlink_to(real)
    check_output("html", str(link), force=True)
    write_output("html", str(link), "new")
    assert link.is_symlink()
    assert real.read_text() == "new"
    assert sorted(tmp_path.iterdir()) == [tmp_path / "far", link]


def test_link_into_a_missing_folder_is_refused(tmp_path: Path) -> None:
    link = tmp_path / "link.html"
    link.symlink_to(tmp_path / "none" / "real.html")
    with pytest.raises(ParameterError, match=r"folder that exists, .*none does not"):
        check_output("html", str(link), force=True)
    with pytest.raises(ParameterError, match="html cannot be written: No such file"):
        write_output("html", str(link), "new")


def test_folders_and_links_to_themselves_are_refused(tmp_path: Path) -> None:
    loop = tmp_path / "loop.html"
    loop.symlink_to(loop)
    with pytest.raises(ParameterError, match="html must be a file, not a link to itself"):
        check_output("html", str(loop), force=True)
    with pytest.raises(ParameterError, match="html must be a file, not a folder"):
        check_output("html", str(tmp_path), force=True)


def test_two_outputs_cannot_be_the_same_file(tmp_path: Path) -> None:
    file, link = tmp_path / "a.csv", tmp_path / "link"
    link.symlink_to(tmp_path)
    check_outputs(force=True, json=str(file), html=str(tmp_path / "b.html"), trace=None)
    for same in (str(file), str(tmp_path / "." / "a.csv"), str(link / "a.csv")):
        with pytest.raises(ParameterError, match="trace and json cannot both be written to"):
            check_outputs(force=True, trace=str(file), html=None, json=same)
    with pytest.raises(ParameterError, match="json and html cannot both go to standard output"):
        check_outputs(force=True, json="-", html="-")
    with pytest.raises(ParameterError, match="html must lie in a folder that exists"):
        check_outputs(force=True, json="-", html=str(tmp_path / "none" / "b.html"))


def test_existing_file_is_kept_without_force(tmp_path: Path) -> None:
    target = tmp_path / "result.json"
    target.write_text("old")
    with pytest.raises(ParameterError, match=r"json exists: .*; force=True replaces it"):
        check_outputs(force=False, json=str(target))
    check_outputs(force=False, json=os.devnull)  # nothing is lost
    check_outputs(force=False, json="-")


def test_name_that_is_too_long_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="json cannot be written: File name too long"):
        check_output("json", str(tmp_path / (300 * "x")), force=False)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the system has no full device")
def test_answer_is_printed_before_a_file_that_does_not_fit(
    capsys: pytest.CaptureFixture[str],
) -> None:
    page = terminal_page(Paragraph("the answer", "code"))
    with pytest.raises(ParameterError, match="json cannot be written: No space left"):
        Outputs(json="/dev/full").write({}, page, extra_line="what to do next")
    assert capsys.readouterr().out.split("\n") == ["the answer", "what to do next", ""]
