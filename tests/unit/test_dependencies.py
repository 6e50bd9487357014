import ast
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
OURS = {"hoz_dist", "workers", "learner", "tests"}


def imported_by(*folders: str) -> set[str]:
    """Return the names of the distributions that the modules in folders import."""
    modules: set[str] = set()
    for path in (path for folder in folders for path in (ROOT / folder).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                modules |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module:
                modules.add(node.module.partition(".")[0])
    distributions = packages_distributions()
    foreign = modules - OURS - sys.stdlib_module_names
    return {canonicalize_name(distributions.get(module, [module])[0]) for module in foreign}


def test_what_is_imported_is_declared_and_what_is_declared_is_imported() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    declared = {canonicalize_name(Requirement(text).name) for text in project["dependencies"]}
    optional = {canonicalize_name(Requirement(text).name) for text in project["optional-dependencies"]["resnet"]}
    # torch.utils.tensorboard imports tensorboard for us.
    assert imported_by("hoz_dist", "workers", "learner") - optional == declared - {"tensorboard"}
