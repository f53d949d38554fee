"""The documentation agrees with the package: names, code blocks, formulas and resources.

The pages themselves are built by ``make docs``, where warnings are errors.
"""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import asperity
from asperity.core.errors import AsperityError
from asperity.devices import device_names

DOCS = Path(__file__).parents[2] / "docs"
BUILT = DOCS / "_build" / "html"
_GENERATED = {"_build", "_generated", "gallery"}
PAGES = sorted(
    path for path in DOCS.rglob("*.md") if path.relative_to(DOCS).parts[0] not in _GENERATED
)
TUTORIALS = [page for page in PAGES if page.parent.name == "tutorials" and page.stem != "index"]
_BLOCK = re.compile(r"^```(\{run\}|\{shell\}|python)\n(.*?)^```$", re.M | re.S)
_MATH = re.compile(r"^```\{math\}\n(.*?)^```$", re.M | re.S)
_INLINE = re.compile(r"(?<![\\$`])\$([^$\n][^$]*?)\$(?!\$)")
_NAME = re.compile(r"\{py:\w+\}`~?([\w.]+)`|^\.\. auto\w+:: ([\w.]+)$", re.M)


def _name(page: Path) -> str:
    return str(page.relative_to(DOCS))


@pytest.fixture(scope="module")
def formulas() -> ModuleType:
    pytest.importorskip("sphinx", reason="the documentation's tools are not installed")
    spec = importlib.util.spec_from_file_location("mathsvg", DOCS / "_ext" / "mathsvg.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look up their module
    spec.loader.exec_module(module)
    return module


def test_every_public_name_is_documented() -> None:
    text = "\n".join(page.read_text("utf-8") for page in PAGES if page.parent.name == "api")
    documented = set(re.findall(r"^\.\. (?:auto\w+|py:\w+):: asperity\.(\w+)$", text, re.M))
    assert set(asperity.__all__) - documented == set()
    assert documented - set(asperity.__all__) == set()


def test_no_reference_page_documents_more_than_a_few_names() -> None:
    counts = {
        page.stem: len(re.findall(r"^\.\. auto\w+::", page.read_text("utf-8"), re.M))
        for page in PAGES
        if page.parent.name == "api" and page.stem in {"surfaces", "analysis", "recordings"}
    }
    assert len(counts) == 3
    assert max(counts.values()) <= 14
    assert "public" not in {page.stem for page in PAGES}


def test_glossary_is_sorted_and_defines_terms_of_the_tables() -> None:
    text = (DOCS / "glossary.md").read_text("utf-8")
    terms = re.findall(r"^(\S.*)\n  \S", text, re.M)
    assert len(terms) > 35
    assert terms == sorted(terms, key=str.casefold)
    columns = ("leak", "click", "felt, borderline, not felt", "recommended stiffness", "v\\*")
    assert set(columns) <= set(terms)


def test_every_device_has_a_page() -> None:
    text = "\n".join(path.read_text("utf-8") for path in (DOCS / "devices").glob("*.md"))
    assert sorted(re.findall(r"^```{device} (\S+)$", text, re.M)) == device_names()


def _resolve(target: str) -> Any:
    parts = target.split(".")
    for split in range(len(parts), 0, -1):
        try:
            value: Any = importlib.import_module(".".join(parts[:split]))
        except ModuleNotFoundError:
            continue
        for part in parts[split:]:
            # A field of a dataclass without a default is not an attribute of the class.
            fields = getattr(value, "__dataclass_fields__", {})
            value = fields[part] if part in fields else getattr(value, part)
        return value
    raise ModuleNotFoundError(target)


@pytest.mark.parametrize("page", PAGES, ids=_name)
def test_names_that_a_page_refers_to_exist(page: Path) -> None:
    for role_target, directive_target in _NAME.findall(page.read_text("utf-8")):
        assert _resolve(role_target or directive_target) is not None


def test_missing_name_is_detected() -> None:
    with pytest.raises(AttributeError):
        _resolve("asperity.analysis.energy.straight_scan.nothing_of_the_kind")


def _run_block(kind: str, body: str, names: dict[str, Any]) -> None:
    lines = body.splitlines()
    options = [line for line in lines if re.match(r":[\w-]+:", line)]
    code = "\n".join(line for line in lines if line not in options)
    if kind == "{shell}":
        return  # the command line is tested elsewhere
    compiled = compile(code, "<page>", "exec")
    if ":error:" not in options:
        exec(compiled, names)
        return
    with pytest.raises(AsperityError):
        exec(compiled, names)


@pytest.mark.parametrize("page", TUTORIALS, ids=_name)
def test_code_of_a_tutorial_runs(page: Path, tmp_path: Path) -> None:
    blocks = _BLOCK.findall(page.read_text("utf-8"))
    assert len(blocks) >= 4
    names: dict[str, Any] = {"__name__": "__main__"}
    with contextlib.chdir(tmp_path):
        for kind, body in blocks:
            _run_block(kind, body, names)


def test_displayed_formulas_have_unique_labels() -> None:
    labels = []
    for page in PAGES:
        for body in _MATH.findall(page.read_text("utf-8")):
            assert body.startswith(":label: eq-"), f"{_name(page)}: {body}"
            labels.append(body.splitlines()[0])
    assert len(labels) > 25
    assert len(set(labels)) == len(labels)


@pytest.mark.parametrize("page", [p for p in PAGES if p.parent.name == "theory"], ids=_name)
def test_every_formula_of_the_theory_can_be_rendered(page: Path, formulas: ModuleType) -> None:
    text = page.read_text("utf-8")
    displayed = ["\n".join(body.splitlines()[1:]) for body in _MATH.findall(text)]
    prose = re.sub(r"^```.*?^```$", "", text, flags=re.M | re.S)
    for formula in [*displayed, *_INLINE.findall(prose)]:
        assert 'fill="currentColor"' in formulas.render_svg(formula, "formula"), formula


def test_invalid_formula_is_detected(formulas: ModuleType) -> None:
    with pytest.raises(ValueError, match="nothingofthekind"):
        formulas.render_svg(r"\nothingofthekind{x}", "formula")


class _ResourceParser(HTMLParser):
    """Parser that collects the addresses of resources that a page loads, without its links."""

    def __init__(self) -> None:
        super().__init__()
        self.addresses: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        attributes = dict(attrs)
        is_media = tag in {"script", "img", "iframe", "source", "video", "audio", "embed", "object"}
        names = ["src", "srcset", "data"] if is_media else ["href"] if tag == "link" else []
        if tag == "link" and attributes.get("rel") in {"canonical", "alternate"}:
            return
        self.addresses += [str(attributes[name]) for name in names if attributes.get(name)]


def _external_resources(page: str) -> list[str]:
    reader = _ResourceParser()
    reader.feed(page)
    styles = re.findall(r"(?:url\(|@import\s+)[\"']?((?:https?:)?//[^\"')\s]+)", page)
    return [a for a in reader.addresses if re.match(r"(https?:)?//", a)] + styles


def test_built_pages_load_no_external_resources() -> None:
    pages = sorted(BUILT.rglob("*.html")) if BUILT.exists() else []
    if not pages:
        pytest.skip("the documentation is not built here: make docs")
    for page in pages:
        assert _external_resources(page.read_text("utf-8")) == [], page
    for sheet in BUILT.rglob("*.css"):
        assert _external_resources(sheet.read_text("utf-8")) == [], sheet


@pytest.mark.parametrize(
    "page",
    [
        '<script src="https://example.org/a.js"></script>',
        '<link rel="stylesheet" href="//example.org/a.css">',
        "<style>@import url(https://example.org/a.css)</style>",
    ],
)
def test_external_resource_is_detected(page: str) -> None:
    assert _external_resources(page) != []
    assert _external_resources('<a href="https://example.org">a link is no load</a>') == []
