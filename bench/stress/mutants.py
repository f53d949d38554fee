"""Mutation testing: a seeded sample of mutants for each part of the code.

``make mutants`` copies the project, lets Cosmic Ray plan its mutations of a room, draws a sample of
them with a seed, and runs the tests of that room against each. A mutant that no test kills is
printed with its difference, unless ``bench/stress/mutants_explained.toml`` explains why it is
equivalent. It takes minutes per room, so it is not part of the tests.

    python bench/stress/mutants.py [--count 20] [--seed 1] [--keep FOLDER] [ROOM ...]

It runs in an environment of its own that has Cosmic Ray, and starts the tests with ``--python``.
"""

from __future__ import annotations

import argparse
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

# Cosmic Ray is not installed where types are checked, and has no type information.
from cosmic_ray.work_db import WorkDB, use_db  # type: ignore[import-not-found] # see above
from cosmic_ray.work_item import TestOutcome, WorkerOutcome, WorkResult  # type: ignore[import-not-found] # see above

ROOT = Path(__file__).resolve().parents[2]
EXPLAINED = ROOT / "bench" / "stress" / "mutants_explained.toml"
TIMEOUT = 600.0  # [s] for the tests of one mutant; one that hangs is killed
# Informative mutations: exchanged operators, comparisons, signs, truth values, numbers
# that are off by one, loops that never run. Excluded: types, operators that fail at once.
_OPERATORS = re.compile(
    r"core/(ReplaceBinaryOperator_(Add_Sub|Sub_Add|Mul_Div|Div_Mul|Pow_Mul)"
    r"|ReplaceComparisonOperator_(Lt_LtE|LtE_Lt|Gt_GtE|GtE_Gt|Lt_GtE|Gt_LtE|Eq_NotEq|NotEq_Eq"
    r"|LtE_Gt|GtE_Lt|Is_IsNot|IsNot_Is)"
    r"|ReplaceUnaryOperator_(USub_UAdd|Delete_USub|Delete_Not)|AddNot|ReplaceTrueWithFalse"
    r"|ReplaceFalseWithTrue|ReplaceAndWithOr|ReplaceOrWithAnd|ReplaceBreakWithContinue"
    r"|ReplaceContinueWithBreak|NumberReplacer|ZeroIterationForLoop)"
)


# The folder below src/asperity, and the tests that are run against its mutants.
ROOMS = {
    "derive": ("derive", "tests/derive", "tests/laws"),
    "contacts": (
        "contacts",
        "tests/contacts",
        "tests/paper/test_reference.py",
        "tests/derive",
        "tests/laws",
    ),
    "kernels": (
        "kernels",
        "tests/kernels",
        "tests/test_surface.py",
        "tests/enclosures/test_taylor.py",
    ),
    "passivity": (
        "analysis/passivity",
        "tests/analysis/passivity",
        "tests/seams/test_user_criterion.py",
    ),
    "limits": ("analysis/limits", "tests/analysis/limits"),
    "bounds": (
        "analysis/bounds",
        "tests/analysis/bounds",
        "tests/analysis/gain",
        "tests/enclosures/test_taylor.py",
    ),
    "gain": ("analysis/gain", "tests/analysis/gain", "tests/analysis/bounds"),
    "energy": ("analysis/energy", "tests/analysis/energy", "tests/analysis/bounds"),
    "simulation": ("simulation", "tests/simulation"),
}


@dataclass(frozen=True)
class Mutant:
    """The outcome of one mutation.

    Attributes:
        module: path below ``src/asperity``.
        change: the removed and added lines, without their numbers.
        survived: whether no test failed.
    """

    module: str
    change: str
    survived: bool


def copy_tree(folder: Path) -> Path:
    """Copy the files known to git, and link ``../shared`` if it exists."""
    tree = folder / "tree"
    known = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        check=True,
        capture_output=True,
    ).stdout.decode()
    for name in filter(None, known.split("\0")):
        if (ROOT / name).is_file():
            (tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, tree / name)
    if (ROOT.parent / "shared").exists():
        (folder / "shared").symlink_to(ROOT.parent / "shared")
    return tree


def plan_mutants(tree: Path, name: str, python: str) -> tuple[Path, Path]:
    """Plan the mutants of a room; return the paths of configuration and session."""
    folder, *tests = ROOMS[name]
    command = f"{python} -m pytest -x -q -n 0 -p no:cacheprovider {' '.join(tests)}"
    lines = [
        "[cosmic-ray]",
        f"module-path = 'src/asperity/{folder}'",
        f"timeout = {TIMEOUT}",
        'excluded-modules = ["src/asperity/derive/generated/*"]',
        f'test-command = "{command}"',
        "[cosmic-ray.distributor]",
        'name = "local"',
    ]
    config, session = tree / f"{name}.toml", tree / f"{name}.sqlite"
    config.write_text("\n".join(lines) + "\n", "utf-8")
    _cosmic_ray(tree, "init", config.name, session.name)
    return config, session


def _cosmic_ray(tree: Path, *arguments: str) -> None:
    environment = {
        **os.environ,
        "PYTHONPATH": "src",
        "PYTHONDONTWRITEBYTECODE": "1",
        "ASPERITY_CACHE_DIR": str(tree.parent / "cache"),
    }
    command = [str(Path(sys.executable).with_name("cosmic-ray")), *arguments]
    subprocess.run(command, cwd=tree, check=True, env=environment)


def select_mutants(session: Path, count: int, seed: int) -> int:
    """Select a sample of the planned mutants; return the number to choose from."""
    with use_db(str(session), WorkDB.Mode.open) as work:
        items = sorted(work.work_items, key=lambda item: _order(item.mutations[0]))
        useful = [item for item in items if _is_effective(session.parent, item.mutations[0])]
        sample = {
            item.job_id for item in random.Random(seed).sample(useful, min(count, len(useful)))
        }
        rest = [item.job_id for item in items if item.job_id not in sample]
        work.set_multiple_results(rest, WorkResult(WorkerOutcome.SKIPPED))
    return len(useful)


def _is_effective(tree: Path, mutation: Any) -> bool:
    """Return whether a mutation is of a kind that tests can notice, and not of a decorator."""
    line = (tree / mutation.module_path).read_text("utf-8").splitlines()[mutation.start_pos[0] - 1]
    return bool(_OPERATORS.fullmatch(mutation.operator_name)) and not line.lstrip().startswith("@")


def _order(mutation: object) -> tuple[str, ...]:
    fields = ("module_path", "start_pos", "operator_name", "occurrence", "operator_args")
    return tuple(str(getattr(mutation, field)) for field in fields)


def read_outcomes(session: Path) -> list[Mutant]:
    """Return the outcomes of the sample."""
    found = []
    with use_db(str(session), WorkDB.Mode.open) as work:
        modules = {item.job_id: item.mutations[0].module_path for item in work.work_items}
        for job, result in work.results:
            if result.worker_outcome == WorkerOutcome.SKIPPED:
                continue
            lines = [
                line
                for line in (result.diff or "").splitlines()
                if line[:1] in "+-" and line[:3] not in ("+++", "---")
            ]
            module = str(modules[job]).removeprefix("src/asperity/")
            found.append(
                Mutant(module, "\n".join(lines), result.test_outcome == TestOutcome.SURVIVED)
            )
    return found


def load_explanations() -> dict[tuple[str, str], str]:
    """Return the reasons for which mutants are equivalent, by module and change."""
    if not EXPLAINED.exists():
        return {}
    entries = tomllib.loads(EXPLAINED.read_text("utf-8")).get("mutant", [])
    return {(one["module"], one["change"].strip("\n")): one["reason"] for one in entries}


def main(arguments: Sequence[str]) -> int:
    """Run the given rooms or all; return 1 if a survivor is not explained."""
    parser = argparse.ArgumentParser(description="a seeded sample of mutants, room by room")
    parser.add_argument("rooms", nargs="*", choices=[*ROOMS, []], help="default: all")
    parser.add_argument("--count", type=int, default=20, help="mutants of each room")
    parser.add_argument("--seed", type=int, default=1, help="of the sample")
    parser.add_argument("--python", default=sys.executable, help="runs the tests")
    parser.add_argument("--keep", type=Path, help="folder to keep for inspection")
    given = parser.parse_args(arguments)
    folder = given.keep or Path(tempfile.mkdtemp(prefix="mutants-"))
    reasons, total, killed, equivalent, unexplained = load_explanations(), 0, 0, 0, []
    try:
        tree = copy_tree(folder)
        for name in given.rooms or ROOMS:
            config, session = plan_mutants(tree, name, given.python)
            _cosmic_ray(tree, "baseline", config.name)
            choice = select_mutants(session, given.count, given.seed)
            _cosmic_ray(tree, "exec", config.name, session.name)
            mutants = read_outcomes(session)
            alive = [one for one in mutants if one.survived]
            same = [one for one in alive if (one.module, one.change) in reasons]
            print(
                f"{name}: {len(mutants)} of {choice} mutants, {len(mutants) - len(alive)} killed, "
                f"{len(same)} equivalent, {len(alive) - len(same)} survived",
                flush=True,
            )
            unexplained += [one for one in alive if one not in same]
            total, killed = total + len(mutants), killed + len(mutants) - len(alive)
            equivalent += len(same)
    finally:
        if given.keep is None:
            shutil.rmtree(folder, ignore_errors=True)
    for one in unexplained:
        print(f"\n{one.module}\n{one.change}")
    share = 100.0 * killed / max(total - equivalent, 1)
    print(
        f"\n{total} mutants, seed {given.seed}: {killed} killed, {equivalent} equivalent; "
        f"{share:.1f} % of those that change something"
    )
    return int(bool(unexplained))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
