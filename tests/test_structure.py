"""`scripts/structure.py` finds a forbidden arrow, a circle and a long function, and takes none for one that is none."""

import importlib.util
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parent.parent
MARKERS = "# Architecture\n\n<!-- figures: scripts/structure.py -->\n<!-- end of figures -->\n"


def workspace(root, crates):
    """A workspace of `crates`: name -> (names that it depends on, {file: source})."""
    (root / "ARCHITECTURE.md").write_text(MARKERS)
    (root / "Cargo.toml").write_text('[workspace]\nresolver = "3"\nmembers = ["crates/*"]\n')
    for name, (dependencies, sources) in crates.items():
        folder = root / "crates" / name
        for file, source in sources.items():
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
            (folder / file).write_text(source)
        lines = [f'{other} = {{ path = "../{other}" }}' for other in dependencies]
        manifest = ["[package]", f'name = "{name}"', 'version = "0.1.0"', 'edition = "2024"', "[dependencies]", *lines]
        (folder / "Cargo.toml").write_text("\n".join(manifest) + "\n")
    return root


def structure(root, *options):
    command = [sys.executable, ROOT / "scripts/structure.py", "--root", root, *options]
    return subprocess.run(command, capture_output=True, text=True)


EMPTY = {"src/lib.rs": "\n"}
CIRCLES = {
    "plain": {
        "src/lib.rs": "mod a;\nmod b;\n",
        "src/a.rs": "use crate::b::B;\npub struct A(B);\n",
        "src/b.rs": "pub struct B;\nfn back(_: super::a::A) {}\n",
    },
    "through names that lib.rs passes on": {
        "src/lib.rs": "mod a;\nmod b;\npub use a::A;\npub use b::{self, B as Renamed};\n",
        "src/a.rs": "use crate::{Renamed};\npub struct A(Renamed);\n",
        "src/b.rs": "use crate::*;\npub struct B;\nfn back(_: A) {}\n",
    },
    "of four, by way of a folder": {
        "src/lib.rs": "pub mod a;\npub mod b;\npub mod c;\n",
        "src/a/mod.rs": "use crate::b;\nmod deep;\npub use deep::Deep;\npub struct A(b::B);\n",
        "src/a/deep.rs": "use super::A;\npub struct Deep(A);\n",
        "src/b.rs": "use crate::c::C;\npub struct B(C);\n",
        "src/c.rs": "pub struct C;\nmod inner {\n    fn back(_: super::super::a::Deep) {}\n}\n",
    },
}
NO_CIRCLES = {
    "a parent's list of its children": {
        "src/lib.rs": "mod a;\npub trait Effect {}\npub const LIST: &[&dyn Effect] = &[&a::A];\n",
        "src/a.rs": "use super::Effect;\npub struct A;\nimpl Effect for A {}\n",
    },
    "in tests, comments and strings": {
        "src/lib.rs": "mod a;\nmod b;\n",
        "src/a.rs": "pub struct A(crate::b::B);\n",
        "src/b.rs": '//! crate::a::A\npub struct B;\nconst TEXT: &str = "crate::a::A";\n'
        "#[cfg(test)]\nmod tests {\n    use crate::a::A;\n    fn back(_: A) {}\n}\n",
    },
    "a facade": {
        "src/lib.rs": "pub mod a;\npub mod b;\n",
        "src/a/mod.rs": "mod one;\nmod two;\npub use one::One;\npub use two::Two;\n",
        "src/a/one.rs": "pub struct One;\n",
        "src/a/two.rs": "use super::One;\npub struct Two(One, crate::b::B);\n",
        "src/b.rs": "use crate::a::One;\npub struct B(One);\n",
    },
}


def test_the_walls_of_this_workspace_stand():
    spec = importlib.util.spec_from_file_location("structure", ROOT / "scripts/structure.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["structure"] = module
    spec.loader.exec_module(module)
    packages = module.members(ROOT)
    assert {package["name"] for package in packages} == set(module.WALLS)
    assert module.broken_walls(ROOT, packages) == []


def test_a_forbidden_arrow_is_named(tmp_path):
    root = workspace(tmp_path, {"wire": ([], EMPTY), "gearmodel": ([], EMPTY), "rigsim": (["wire", "gearmodel"], EMPTY)})
    done = structure(root, "--check")
    assert done.returncode == 1
    assert "crates/rigsim/Cargo.toml: rigsim -> gearmodel is not allowed (rigsim may use: wire)" in done.stderr
    assert "rigsim -> wire is not" not in done.stderr


def test_a_forbidden_arrow_is_seen_on_a_build_script_and_not_on_tests(tmp_path):
    root = workspace(tmp_path, {"wire": ([], EMPTY), "gearmodel": ([], EMPTY), "riglog": (["gearmodel"], EMPTY)})
    manifest = root / "crates/riglog/Cargo.toml"
    allowed = manifest.read_text() + '[dev-dependencies]\nwire = { path = "../wire" }\n'
    manifest.write_text(allowed)
    assert structure(root, "--check").returncode == 0
    manifest.write_text(allowed.replace("dev-", "build-"))
    assert "riglog -> wire is not allowed" in structure(root, "--check").stderr


def test_a_crate_without_a_wall_is_named(tmp_path):
    done = structure(workspace(tmp_path, {"annex": ([], EMPTY)}), "--check")
    assert done.returncode == 1
    assert "crates/annex/Cargo.toml: the crate annex has no line in WALLS" in done.stderr


@pytest.mark.parametrize("name", CIRCLES)
def test_a_circle_is_found(tmp_path, name):
    files = CIRCLES[name]
    done = structure(workspace(tmp_path, {"gearmodel": ([], files)}), "--check")
    assert done.returncode == 1
    assert f"gearmodel: {len(files) - 1} files in a circle" in done.stderr  # all but lib.rs
    assert "crates/gearmodel/src/b.rs uses" in done.stderr


@pytest.mark.parametrize("name", NO_CIRCLES)
def test_no_circle_is_seen_where_there_is_none(tmp_path, name):
    done = structure(workspace(tmp_path, {"gearmodel": ([], NO_CIRCLES[name])}), "--check")
    assert (done.returncode, done.stderr) == (0, "")


def test_a_long_function_more_than_the_document_says_fails(tmp_path):
    body = "    let _ = 1;\n"
    files = {"src/lib.rs": f"pub fn long() {{\n{body * 79}}}\n#[cfg(test)]\nmod tests {{\n    fn long() {{\n{body * 99}    }}\n}}\n"}
    root = workspace(tmp_path, {"gearmodel": ([], files)})
    done = structure(root, "--check")
    assert done.returncode == 1
    assert "crates/gearmodel/src/lib.rs:1 long, 81 lines" in done.stderr
    assert done.stderr.count(" long, ") == 1
    assert structure(root, "--write").returncode == 0
    done = structure(root, "--check")
    assert (done.returncode, done.stdout) == (0, "")


def test_figures_that_drift_are_told_and_figures_that_lack_fail(tmp_path):
    root = workspace(tmp_path, {"gearmodel": ([], EMPTY)})
    structure(root, "--write")
    (root / "crates/gearmodel/src/lib.rs").write_text("\n\n\n")
    done = structure(root, "--check")
    assert done.returncode == 0
    assert "lines of the largest file: 1 (`crates/gearmodel/src/lib.rs`); it is 3" in done.stdout
    (root / "ARCHITECTURE.md").write_text("# Architecture\n")
    done = structure(root, "--check")
    assert done.returncode == 1
    assert "ARCHITECTURE.md: no table" in done.stderr
