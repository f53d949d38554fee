"""The wheel and the source distribution: what is in them, and whether the wheel works elsewhere.

The wheel is installed into an empty environment and run without a C compiler. In the test suite
this is done on the interpreter of the tests with two laws, and its lab takes the machine code of
the suite; ``make dist-test`` does it on each supported version of Python that is found here, with
the newest dependencies, all laws and nothing compiled before.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
import tarfile
import tomllib
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from zipfile import ZipFile

import pytest
from tests.lab.started import Started

import asperity

ROOT = Path(__file__).parents[1]
VERSION = asperity.__version__
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
JUNK = (
    ".mypy_cache/x.json",
    ".pytest_cache/x",
    ".venv/bin/x",
    "build/x",
    "dist/x.whl",
    "uv.lock",
    "report.html",
    "scratch.txt",
    "docs/_build/x.html",
    "docs/_generated/x.md",
    "docs/gallery/x.md",
    "src/asperity/__pycache__/x.pyc",
    "src/asperity/laws/__pycache__/x.pyc",
    "tests/__pycache__/x.pyc",
    "src/asperity.egg-info/PKG-INFO",
)
RUNS_ALL = "ASPERITY_DIST_TEST" in os.environ


def tracked_files() -> set[str]:
    """Return the files of the project, those that are not yet committed included."""
    listing = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    if not (ROOT / ".git").exists() or shutil.which("git") is None:
        pytest.skip("not run: no git repository here")
    result = subprocess.run(listing, cwd=ROOT, capture_output=True, text=True, check=True)
    return {name for name in result.stdout.splitlines() if (ROOT / name).is_file()}


def build(folder: Path) -> dict[str, Path]:
    """Build the project in a folder; return the files by "wheel" and "sdist"."""
    pytest.importorskip("hatchling", reason="not run: no hatchling here")
    shutil.rmtree(folder / "dist", ignore_errors=True)
    command = [sys.executable, "-m", "hatchling", "build"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    (wheel,), (sdist,) = (list((folder / "dist").glob(name)) for name in ("*.whl", "*.tar.gz"))
    return {"wheel": wheel, "sdist": sdist}


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the project with what tools and users leave in it."""
    folder: Path = tmp_path_factory.mktemp("project")
    for name in tracked_files():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, folder / name)
    for name in JUNK:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("junk")
    return folder


@pytest.fixture(scope="module")
def built(copy: Path) -> dict[str, Path]:
    """Return the files that a copy of the project is built into."""
    return build(copy)


@pytest.fixture(scope="module")
def unpacked(built: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the unpacked source distribution."""
    folder: Path = tmp_path_factory.mktemp("sdist")
    with tarfile.open(built["sdist"]) as archive:
        archive.extractall(folder, filter="data")
    return folder / f"asperity-{VERSION}"


def test_sdist_contains_the_project_and_nothing_else(unpacked: Path) -> None:
    names = {str(path.relative_to(unpacked)) for path in unpacked.rglob("*") if path.is_file()}
    assert names - tracked_files() == {"PKG-INFO"}
    assert tracked_files() - names == set()


def test_wheel_contains_the_package_and_nothing_else(built: dict[str, Path]) -> None:
    names = set(ZipFile(built["wheel"]).namelist())
    own = {name for name in names if name.startswith("asperity/")}
    package = {name for name in tracked_files() if name.startswith("src/asperity/")}
    assert own == {name.removeprefix("src/") for name in package}
    information = f"asperity-{VERSION}.dist-info"
    rest = ("METADATA", "RECORD", "WHEEL", "entry_points.txt", "licenses/LICENSE")
    assert names - own == {f"{information}/{name}" for name in rest}
    kinds = {Path(name).suffix for name in own} | {Path(name).name for name in own}
    assert kinds >= {".toml", ".j2", ".js", ".css", ".html", ".c", ".h", "__init__.pyi", "py.typed"}


def test_wheel_contains_machine_code_of_the_source(unpacked: Path) -> None:
    """``make dist`` puts it into the unpacked source distribution, and builds the wheel there."""
    name = "src/asperity/machine_code/cpython-311/0123"
    (unpacked / name).parent.mkdir(parents=True)
    (unpacked / name).write_bytes(b"code")
    with ZipFile(build(unpacked)["wheel"]) as wheel:
        assert wheel.read(name.removeprefix("src/")) == b"code"
    shutil.rmtree(unpacked / "dist")
    shutil.rmtree((unpacked / name).parents[1])


def test_build_is_reproducible(built: dict[str, Path], unpacked: Path, copy: Path) -> None:
    """The same files give the same bytes, at another time and from the source distribution."""
    digests = {kind: hashlib.sha256(path.read_bytes()).digest() for kind, path in built.items()}
    for path in (copy / "src").rglob("*.py"):
        os.utime(path, (1e9, 1e9))
        path.chmod(0o600)
    for folder in (copy, unpacked):
        for kind, path in build(folder).items():
            assert hashlib.sha256(path.read_bytes()).digest() == digests[kind], (folder, kind)


def test_version_stands_in_one_place(unpacked: Path) -> None:
    """The others read it, except where a file cannot: there it is compared."""
    assert f"Version: {VERSION}\n" in (unpacked / "PKG-INFO").read_text("utf-8")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert project["dynamic"] == ["version"]
    assert f"\nversion: {VERSION}\n" in (ROOT / "CITATION.cff").read_text("utf-8")
    changelog = (ROOT / "CHANGELOG.md").read_text("utf-8")
    assert f"\n## [{VERSION}] - 20" in changelog
    assert max(len(section.splitlines()) for section in changelog.split("\n## ")) <= 80
    data = {".mcap", ".png", ".lock"}
    names = {name for name in tracked_files() if Path(name).suffix not in data}
    holders = {name for name in names if VERSION in (ROOT / name).read_text("utf-8", "replace")}
    assert holders <= {"src/asperity/core/version.py", "CITATION.cff", "CHANGELOG.md", "README.md"}


def test_classifiers_name_the_tested_versions() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    prefix = "Programming Language :: Python :: 3."
    versions = [name[len(prefix) - 2 :] for name in project["classifiers"] if prefix in name]
    assert versions == list(PYTHONS)
    assert project["requires-python"] == f">={PYTHONS[0]}"


# --- an empty environment -------------------------------------------------------------------------


def find_uv() -> str:
    """Return the installer, which stands beside the interpreter or in the project's environment."""
    folders = (Path(sys.executable).parent, ROOT / ".venv" / "bin")
    paths = (shutil.which("uv", path=str(folder)) for folder in folders)
    found = next(filter(None, paths), shutil.which("uv"))
    return found or pytest.skip("not run: no uv here")


def find_pythons(wanted: str) -> Iterator[str]:
    """Yield commands that may be this version of Python: this one, of the path, of pyenv."""
    yield sys.executable
    yield f"python{wanted}"
    versions = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    yield from sorted(map(str, versions.glob(f"{wanted}.*/bin/python{wanted}")), reverse=True)


def find_python(wanted: str) -> str:
    """Return a command of this version of Python."""
    code = "import sys; print(*sys.version_info[:2], sep='.')"
    for command in find_pythons(wanted):
        try:
            result = subprocess.run(
                [command, "-c", code], check=False, capture_output=True, text=True
            )
        except OSError:
            continue
        if result.stdout.strip() == wanted:
            return command
    pytest.skip(f"not run: no Python {wanted} here")


def install(wheel: Path, python: str, folder: Path) -> None:
    """Install the wheel with its dependencies into an empty environment.

    In the test suite the dependencies are those of the lock, which need no network if the
    environment of the tests was installed on this machine.
    """
    subprocess.run([python, "-m", "venv", "--without-pip", folder], check=True)
    command = [
        find_uv(),
        "pip",
        "install",
        "--only-binary",
        ":all:",
        "--python",
        folder / "bin" / "python",
        wheel,
    ]
    locked = [] if RUNS_ALL else ["--constraints", ROOT / "requirements.lock"]
    results = []
    for options in ([] if RUNS_ALL else ["--offline"], []):
        whole = [*command, *locked, *options]
        results.append(subprocess.run(whole, check=False, capture_output=True, text=True))
        if results[-1].returncode == 0:
            return
    raise AssertionError(results[-1].stderr)


@pytest.fixture(params=PYTHONS)
def environment(
    request: pytest.FixtureRequest, built: dict[str, Path], tmp_path: Path
) -> dict[str, str]:
    """Return the variables of an environment in which only the wheel is installed."""
    if not (RUNS_ALL or sys.version.startswith(f"{request.param}.")):
        pytest.skip(f"not run: `make dist-test` tries Python {request.param}")
    install(built["wheel"], find_python(request.param), tmp_path / "environment")
    path = str(tmp_path / "environment" / "bin")
    assert not any(shutil.which(name, path=path) for name in ("cc", "gcc", "clang", "c99", "ld"))
    return {"PATH": path, "HOME": str(tmp_path), "ASPERITY_CACHE_DIR": str(tmp_path / "cache")}


@pytest.mark.skipif(sys.platform != "linux", reason="not run: tested on Linux only")
def test_wheel_works_without_a_compiler(environment: dict[str, str], tmp_path: Path) -> None:
    program = f"{environment['PATH']}/asperity"
    laws = "WABCDEFGH" if RUNS_ALL else "WC"
    command = [program, "compare", "knurl", *([] if RUNS_ALL else ["--laws", laws])]
    result = subprocess.run(
        command,
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=900,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    assert result.stdout.startswith("Use law ")
    rows = {line[:1] for line in result.stdout.splitlines() if "N/m" in line or "none" in line}
    assert rows >= set(laws)
    used = environment["ASPERITY_CACHE_DIR"] if RUNS_ALL else os.environ["ASPERITY_CACHE_DIR"]
    lab = Started(
        command=[program, "lab", "--no-browser"],
        environment=environment | {"ASPERITY_CACHE_DIR": used},
    )
    try:
        with urllib.request.urlopen(lab.address, timeout=60) as page:
            assert b"<canvas" in page.read()
        assert lab.end()[0] == 0
    finally:
        lab.close()
