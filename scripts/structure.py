#!/usr/bin/env python3
"""The walls between the crates, circles between files, and the house in figures: scripts/structure.py [--check|--write]

Without an option it prints what it found. --check exits with 1 where a crate depends on one that it may not (WALLS),
where files use each other in a circle, where more functions are long than ARCHITECTURE.md says, or where that document
lacks its figures; figures that have only drifted are told. --write brings the figures of ARCHITECTURE.md up to date.

A circle is a set of files of one crate each of which uses, by whatever way, every other. What counts as a use is a name
that is defined in another file: what `use` brings in and paths in the code. Names that a module passes on are looked
up where they are defined. What a module has of its own children (it declares them, passes their names on, lists them)
is no use; tests are left out. Rust is read by its words here, not compiled: names made by macros are not seen.
"""

import argparse
import json
import re
import statistics
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

# What a crate may use of ours, tests aside. A line that is added here is a decision about the house: see ARCHITECTURE.md.
WALLS = {
    "wire": set(),
    "gearmodel": set(),
    "riglog": {"gearmodel"},
    "diagnosis": {"gearmodel", "riglog"},
    "rigsim": {"wire"},
    "blindtest": {"rigsim", "riglog", "diagnosis", "gearmodel"},
    "rigd": {"wire", "gearmodel", "riglog", "diagnosis", "rigsim", "blindtest"},
    "pybind": {"gearmodel", "riglog", "diagnosis"},
    "rigbench": {"rigd", "rigsim", "wire"},
}
LONG_FUNCTION = 80  # lines
BEGIN, END = "<!-- figures: scripts/structure.py -->", "<!-- end of figures -->"


# --- Rust, read by its words ---------------------------------------------------------------------------------------

TOKEN = re.compile(
    r"//[^\n]*|/\*.*?\*/"  # comments
    r'|b?c?r(?P<hash>#*)".*?"(?P=hash)|b?c?"(?:\\.|[^"\\])*"'  # strings
    r"|b?'(?:\\(?:x..|u\{[^}]*\}|.)|[^'\\\n])'",  # characters, but no lifetimes
    re.DOTALL,
)


def blanked(source: str, strings: bool = True) -> str:
    """The source with its comments, and unless told otherwise its strings, as blanks; lines stay where they are."""

    def blank(match: re.Match) -> str:
        text = match.group()
        if not strings and not text.startswith("/"):
            return text
        return re.sub(r"[^\n]", " ", text)

    return TOKEN.sub(blank, source)


def end_of_block(code: str, opening: int) -> int:
    """The place after the brace that closes the one at `opening`."""
    depth = 0
    for match in re.compile(r"[{}]").finditer(code, opening):
        depth += 1 if match.group() == "{" else -1
        if depth == 0:
            return match.end()
    return len(code)


def end_of_item(code: str, start: int) -> int:
    """The place after the item that begins at `start`: a semicolon or a block outside all brackets."""
    depth = 0
    for match in re.compile(r"[][(){};]").finditer(code, start):
        token = match.group()
        if token in "([":
            depth += 1
        elif token in ")]":
            depth -= 1
        elif depth == 0 and token in "{;":
            if token == ";":
                return match.end()
            end = end_of_block(code, match.start())
            return end + 1 if code[start:match.start()].lstrip().startswith(("use ", "pub use ")) else end
    return len(code)


def without_tests(code: str, text: str) -> tuple[str, str, set[str]]:
    """Blanks of `code` and `text`, which are alike in length, what is compiled for tests alone; and the modules so declared."""
    modules = set()
    for match in reversed(list(re.finditer(r"#\[cfg\(test\)\]\s*(#\[[^\]]*\]\s*)*", code))):
        end = end_of_item(code, match.end())
        if declared := re.match(r"(?:pub(?:\([^)]*\))?\s+)?mod\s+(\w+)\s*;", code[match.end() : end]):
            modules.add(declared[1])
        hole = re.sub(r"[^\n]", " ", code[match.start() : end])
        code = code[: match.start()] + hole + code[end:]
        text = text[: match.start()] + hole + text[end:]
    return code, text, modules


def use_tree(tree: str, prefix: tuple[str, ...] = ()) -> list[tuple[tuple[str, ...], str]]:
    """The paths that `a::{b, c as d, e::*}` brings in, each with the name that it has then ("*" for all)."""
    tree = tree.strip()
    if brace := re.match(r"([^{]*?)(?:::)?\s*\{(.*)\}$", tree, re.DOTALL):
        head = prefix + tuple(part.strip() for part in brace[1].split("::") if part.strip())
        depth, begin, parts = 0, 0, []
        for place, letter in enumerate(brace[2] + ","):
            depth += (letter == "{") - (letter == "}")
            if letter == "," and depth == 0:
                parts.append(brace[2][begin:place])
                begin = place + 1
        return [found for part in parts if part.strip() for found in use_tree(part, head)]
    path, _, name = tree.partition(" as ")
    parts = prefix + tuple(part.strip() for part in path.split("::") if part.strip())
    if parts[-1] == "self":
        parts = parts[:-1]
    return [(parts, name.strip() or parts[-1])]


@dataclass
class Module:
    """A module of a crate: what it defines, brings in and passes on."""

    path: tuple[str, ...]
    file: Path
    code: str  # without `use`, modules of its own block, comments, strings and tests
    items: set[str] = field(default_factory=set)
    imports: dict[str, tuple[str, ...]] = field(default_factory=dict)
    passed_on: set[str] = field(default_factory=set)  # names among `imports` that are `pub use`
    globs: list[tuple[tuple[str, ...], bool]] = field(default_factory=list)  # (path, whether `pub`)


ITEM = re.compile(r"\b(?:fn|struct|enum|union|trait|type|const|static|macro_rules!)\s+(?:mut\s+)?(\w+)")
USE = re.compile(r"(?P<pub>\bpub(?:\s*\([^)]*\))?\s+)?\buse\s+(?P<tree>[^;]+);")
PATH = re.compile(r"(?<![\w:$])\$?((?:\w+\s*::\s*)+)(\w+)")


def modules_of(path: tuple[str, ...], file: Path, code: str) -> list[Module]:
    """The module of a file and those that it holds in blocks."""
    found = []
    while block := re.search(r"(?:\bpub(?:\s*\([^)]*\))?\s+)?\bmod\s+(\w+)\s*\{", code):
        end = end_of_block(code, block.end() - 1)
        found += modules_of((*path, block[1]), file, code[block.end() : end - 1])
        code = code[: block.start()] + code[end:]
    module = Module(path, file, USE.sub("", code))
    for use in USE.finditer(code):
        for parts, name in use_tree(use["tree"]):
            if parts[-1] == "*":
                module.globs.append((parts[:-1], bool(use["pub"])))
            else:
                module.imports[name] = parts
                if use["pub"]:
                    module.passed_on.add(name)
    module.items = set(ITEM.findall(module.code))
    return [module, *found]


class Crate:
    """The modules of a crate and which of its files use which."""

    def __init__(self, root: Path) -> None:
        self.modules: dict[tuple[str, ...], Module] = {}
        self.sources: dict[Path, tuple[str, str]] = {}  # code, and text with strings, both without tests
        self.read((), root)

    def read(self, path: tuple[str, ...], file: Path) -> None:
        """Takes up the file of a module, then those of the modules that it declares."""
        source = file.read_text(encoding="utf-8")
        code, text, _ = without_tests(blanked(source), blanked(source, strings=False))
        self.sources[file] = code, text
        folder = file.parent if file.name in ("lib.rs", "mod.rs") else file.with_suffix("")
        for declared in re.finditer(r'((?:#\[[^\]]*\]\s*)*)\bmod\s+(\w+)\s*;', code):
            elsewhere = re.search(r'#\[path\s*=\s*"([^"]*)"', text[declared.start(1) : declared.end(1)])
            places = [folder / f"{declared[2]}.rs", folder / declared[2] / "mod.rs"]
            for place in [file.parent / elsewhere[1]] if elsewhere else places:
                if place.exists():
                    self.read((*path, declared[2]), place)
        for module in modules_of(path, file, code):
            self.modules[module.path] = module

    def resolve(self, at: tuple[str, ...], parts: tuple[str, ...], seen: frozenset = frozenset()):
        """What a path means in the module `at`: ("module" or "item", file), or None for what is not of this crate."""
        if (at, parts) in seen or len(seen) > 32:
            return None
        seen |= {(at, parts)}
        here, rest = at, parts
        if rest[0] in ("crate", "$crate"):
            here, rest = (), rest[1:]
        while rest and rest[0] in ("self", "super"):
            here, rest = (here[:-1] if rest[0] == "super" else here), rest[1:]
        if here not in self.modules:
            return None
        module = self.modules[here]
        if not rest:
            return "module", module.file
        name = rest[0]
        if (*here, name) in self.modules and (len(rest) > 1 or name not in module.items):
            return self.resolve((*here, name), ("self", *rest[1:]), seen)
        if name in module.items:
            return "item", module.file
        if name in module.imports and (found := self.resolve(here, module.imports[name] + rest[1:], seen)):
            return found
        for parts_of_glob, _ in module.globs:
            ours = parts_of_glob[0] in ("crate", "self", "super") or (*here, parts_of_glob[0]) in self.modules
            if ours and (found := self.resolve(here, (*parts_of_glob, *rest), seen)):
                return found
        return None

    def children(self, file: Path) -> set[Path]:
        """The files of the modules that a file declares."""
        mine = {module.path for module in self.modules.values() if module.file == file}
        return {module.file for module in self.modules.values() if module.path and module.path[:-1] in mine}

    def uses(self) -> dict[Path, dict[Path, str]]:
        """For each file the files that it uses, each with a name that it uses of it."""
        uses: dict[Path, dict[Path, str]] = {file: {} for file in self.sources}
        own = {file: {file} | self.children(file) for file in self.sources}

        def note(module: Module, parts: tuple[str, ...]) -> None:
            found = self.resolve(module.path, parts)
            if found and found[0] == "item" and found[1] not in own[module.file]:
                uses[module.file].setdefault(found[1], "::".join(parts))

        for module in self.modules.values():
            words = set(re.findall(r"\w+", module.code))
            for name, parts in module.imports.items():
                if name not in module.passed_on or name in words:
                    note(module, parts)
            for parts, public in module.globs:
                found = self.resolve(module.path, parts)
                if found and not public:
                    for other in self.modules.values():
                        if other.file == found[1]:
                            for name in words & (other.items | set(other.imports)):
                                note(module, (*parts, name))
            for path in PATH.finditer(module.code):
                note(module, tuple(re.findall(r"\w+", path.group())))
        return uses

    def circles(self) -> list[tuple[list[Path], dict[Path, dict[Path, str]]]]:
        """The sets of files that use each other (strongly connected components of two files and more), with their uses."""
        uses = self.uses()
        reach: dict[Path, set[Path]] = {}
        for file in uses:
            reach[file], todo = set(), [file]
            while todo:
                for other in uses[todo.pop()]:
                    if other not in reach[file]:
                        reach[file].add(other)
                        todo.append(other)
        found, done = [], set()
        for file in sorted(uses):
            if file in reach[file] and file not in done:
                members = sorted(other for other in reach[file] if file in reach[other])
                done |= set(members)
                found.append((members, {one: {two: uses[one][two] for two in members if two in uses[one]} for one in members}))
        return found


# --- The workspace -------------------------------------------------------------------------------------------------


def members(root: Path) -> list[dict]:
    """The crates of the workspace as `cargo metadata` has them."""
    command = ["cargo", "metadata", "--no-deps", "--offline", "--format-version", "1"]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"structure: cargo metadata failed in {root}:\n{done.stderr}")
    return sorted(json.loads(done.stdout)["packages"], key=lambda package: package["name"])


def broken_walls(root: Path, packages: list[dict]) -> list[str]:
    """Each arrow between two crates that WALLS does not have, and what to do about it."""
    ours = {package["name"] for package in packages}
    faults = []
    for package in packages:
        name, manifest = package["name"], Path(package["manifest_path"]).relative_to(root)
        if name not in WALLS:
            faults.append(f"{manifest}: the crate {name} has no line in WALLS of scripts/structure.py; add what it may use")
            continue
        for dependency in package["dependencies"]:
            other = dependency["name"]
            if dependency["kind"] != "dev" and other in ours and other not in WALLS[name]:
                allowed = ", ".join(sorted(WALLS[name])) or "none of ours"
                faults.append(
                    f"{manifest}: {name} -> {other} is not allowed ({name} may use: {allowed}); take the dependency out, and move"
                    " what both need to a crate that both may use, or what needs it to a crate above"
                )
    return faults


def long_functions(file: Path, code: str) -> list[tuple[int, str]]:
    """The functions of a file with more than LONG_FUNCTION lines, the longest first."""
    found = []
    for head in re.finditer(r"\bfn\s+(\w+)", code):
        end = end_of_item(code, head.end())
        lines = code.count("\n", head.start(), end) + 1
        if lines > LONG_FUNCTION:
            found.append((lines, f"{file}:{code.count(chr(10), 0, head.start()) + 1} {head[1]}, {lines} lines"))
    return sorted(found, reverse=True)


@dataclass
class House:
    """What the structure of the workspace is."""

    walls: list[str]
    circles: list[str]
    functions: list[str]
    figures: list[tuple[str, str]]


def lines_of(file: Path) -> int:
    return file.read_text(encoding="utf-8").count("\n")


def survey(root: Path) -> House:
    """Reads the workspace."""
    packages = members(root)
    circles, functions, sources, crate_lines, file_lines = [], [], {}, {}, {}
    for package in packages:
        folder = Path(package["manifest_path"]).parent
        files = [file for file in sorted(folder.rglob("*.rs")) if not {"target", "generated"} & set(file.relative_to(folder).parts)]
        for file in files:
            file_lines[file.relative_to(root)] = lines_of(file)
        crate_lines[package["name"]] = sum(lines_of(file) for file in files)
        for start in [start for start in ("lib.rs", "main.rs") if (folder / "src" / start).exists()]:
            crate = Crate(folder / "src" / start)
            sources |= {file.relative_to(root): texts for file, texts in crate.sources.items()}
            for files_of_circle, uses in crate.circles():
                ways = [
                    f"    {one.relative_to(root)} uses {name} of {two.relative_to(root)}"
                    for one in files_of_circle
                    for two, name in uses[one].items()
                ]
                circles.append(f"{package['name']}: {len(files_of_circle)} files in a circle\n" + "\n".join(ways))
    for file, (code, _) in sources.items():
        functions += long_functions(file, code)
    functions = [text for _, text in sorted(functions, reverse=True)]
    walls = broken_walls(root, packages)
    return House(walls, circles, functions, figures(root, sources, walls, circles, functions, crate_lines, file_lines))


def files_naming_effects(root: Path, texts: dict[Path, str]) -> dict[str, int]:
    """For each effect of the library that has a file of its own, the number of source files with its name."""
    library = Path("crates/gearmodel/src/effect/mod.rs")
    names = re.findall(r"\bmod (\w+_\w+);", texts.get(library, ""))
    quoted = {name for name in names if any(f'"{name}"' in text for file, text in texts.items() if file.parent == library.parent)}
    words = [set(re.findall(r"\w+", text)) for text in texts.values()]
    return {name: sum(name in words_of_file for words_of_file in words) for name in quoted}


def figures(root, sources, walls, circles, functions, crate_lines, file_lines) -> list[tuple[str, str]]:
    """The table of ARCHITECTURE.md."""
    largest = max(file_lines, key=lambda file: file_lines[file])
    crates = sorted(crate_lines, key=lambda crate: -crate_lines[crate])
    rows = [
        ("forbidden arrows between crates", str(len(walls))),
        ("circles of files", str(len(circles))),
        (f"functions over {LONG_FUNCTION} lines", str(len(functions))),
        ("lines of a file, median", f"{statistics.median(file_lines.values()):.0f}"),
        ("lines of the largest file", f"{file_lines[largest]} (`{largest}`)"),
        ("lines of the largest crate", f"{crate_lines[crates[0]]} (`{crates[0]}`)"),
        ("lines of all crates", ", ".join(f"{crate} {crate_lines[crate]}" for crate in crates)),
    ]
    if naming := files_naming_effects(root, {file: text for file, (_, text) in sources.items()}):
        most = max(sorted(naming), key=lambda name: naming[name])
        median = statistics.median(naming.values())
        rows.append(("files that name one effect, median and at most", f"{median:.0f}, {naming[most]} (`{most}`)"))
    return rows


# --- The document --------------------------------------------------------------------------------------------------


def table(rows: list[tuple[str, str]]) -> str:
    return "\n".join(["| what | now |", "|---|---|", *(f"| {what} | {now} |" for what, now in rows)])


def written(document: str) -> dict[str, str] | None:
    """The figures in the document, or None where it has none."""
    if BEGIN not in document or END not in document:
        return None
    lines = document.split(BEGIN)[1].split(END)[0].strip().splitlines()[2:]
    return dict((cell.strip() for cell in line.strip("|").split("|", 1)) for line in lines)


def check(house: House, document: str) -> list[str]:
    """What CI does not let pass."""
    faults = list(house.walls)
    faults += [f"{circle}\n    let one of them not use the other: move what both use to a file of its own" for circle in house.circles]
    then = written(document)
    if then is None:
        return [*faults, f"ARCHITECTURE.md: no table between `{BEGIN}` and `{END}`; write the markers, then scripts/structure.py --write"]
    now = dict(house.figures)
    what = f"functions over {LONG_FUNCTION} lines"
    if int(then.get(what, "0")) < int(now[what]):
        longer = "\n    ".join(house.functions)
        faults.append(f"{now[what]} {what}, {then.get(what, 'none')} in ARCHITECTURE.md; divide what grew:\n    {longer}")
    for what in now:
        if then.get(what) != now[what]:
            print(f"structure: ARCHITECTURE.md says of {what}: {then.get(what)}; it is {now[what]} (scripts/structure.py --write)")
    return faults


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--check", action="store_true", help="exit with 1 where a rule is broken")
    arguments.add_argument("--write", action="store_true", help="bring the figures of ARCHITECTURE.md up to date")
    arguments.add_argument("--root", type=Path, default=Path(__file__).resolve().parent.parent, help="the workspace")
    options = arguments.parse_args()
    root = options.root.resolve()
    house = survey(root)
    page = root / "ARCHITECTURE.md"
    document = page.read_text(encoding="utf-8") if page.exists() else ""
    if options.check:
        for fault in (faults := check(house, document)):
            print(f"structure: {fault}", file=sys.stderr)
        return int(bool(faults))
    if options.write:
        if written(document) is None:
            sys.exit(f"structure: {page} has no lines `{BEGIN}` and `{END}`")
        head, rest = document.split(BEGIN)
        page.write_text(f"{head}{BEGIN}\n{table(house.figures)}\n{END}{rest.split(END)[1]}", encoding="utf-8")
        return 0
    print("\n".join([*house.walls, *house.circles, *house.functions]))
    print(table(house.figures))
    return 0


if __name__ == "__main__":
    sys.exit(main())
