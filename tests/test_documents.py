"""What the documents say is so: links and paths exist, commands and options too, samples are what the program prints."""

import functools
import importlib.util
import json
import os
import pathlib
import re
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parent.parent
RIGD = os.environ.get("RIGD", str(ROOT / "target/release/rigd"))


def script(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / f"scripts/{name}.py")
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def sources():
    """Every file of the repository, from its root, without what is built or installed here."""
    for folder, folders, files in os.walk(ROOT):
        folders[:] = [name for name in folders if name not in ("target", ".git", ".venv", "runs", "set-up", "__pycache__")]
        yield from (pathlib.Path(folder, name).relative_to(ROOT).as_posix() for name in files)


FILES = sorted(sources())
DOCUMENTS = [name for name in FILES if name.endswith(".md") and "fixtures" not in pathlib.Path(name).parts]
# What once was is not held against what is.
PRESENT = [name for name in DOCUMENTS if name != "CHANGELOG.md"]
FENCE = re.compile(r"^ *```(\w*)\n(.*?)^ *```", re.MULTILINE | re.DOTALL)


def text_of(document):
    """A document without its blocks of code."""
    return FENCE.sub("", (ROOT / document).read_text(encoding="utf-8"))


def code_spans(document):
    return [re.sub(r"\s+", " ", span) for span in re.findall(r"(?<!`)`([^`]+)`(?!`)", text_of(document))]


# --- Links and paths -----------------------------------------------------------------------------------------------


def anchors(document):
    headings = re.findall(r"^#+ (.*)$", text_of(document), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("document", DOCUMENTS)
def test_links_lead_somewhere(document):
    broken = []
    for target in re.findall(r"\]\(([^)\s]+)\)", text_of(document)):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        there = (ROOT / document).parent / path if path else ROOT / document
        if not there.exists() or (anchor and anchor not in anchors(there.resolve().relative_to(ROOT))):
            broken.append(target)
    assert not broken


PATH = re.compile(r"^[\w.\-*{},/<>]+/[\w.\-*{},/<>]*$|^[\w\-]+\.(rs|py|toml|proto|sh)$")
# Not of this repository: what a person's own directory has, and what programs write.
FOREIGN = re.compile(
    r"^rigd\.[\w.]+/\d$|^(runs|set-up|unfinished|sealed|blind|sick|fresh|DIR)/|^/|^(pair|lab|plan|model|next|profile|calibration|rig|qsb|at0|at120"
    r"|at240|FILE)\.toml$|^(riden/riden|offset|tell)\.py$|^[A-Z]+/"
)


@pytest.mark.parametrize("document", PRESENT)
def test_paths_in_code_spans_exist(document):
    """As a path from the root or the document, or the end of one from the root; `*` and `<name>` stand for anything."""
    missing = []
    for span in code_spans(document):
        if not PATH.match(span) or FOREIGN.match(span) or not re.search(r"[a-z]{2}", span):
            continue
        pattern = re.escape(span.removeprefix("./").rstrip("/"))
        pattern = re.sub(r"\\\*|<\w+>", "[^/]*", pattern)
        pattern = re.sub(r"\\\{([^}]*)\\\}", lambda group: "(" + group[1].replace(",", "|") + ")", pattern)
        if not any(re.search(rf"(^|/){pattern}(/|$)", name) for name in FILES):
            missing.append(span)
    assert not missing


@functools.cache
def crate(name):
    structure = sys.modules.get("structure") or script("structure")
    return structure.Crate(ROOT / f"crates/{name}/src/lib.rs")


CRATES = [path.parts[1] for path in map(pathlib.Path, FILES) if path.parts[0] == "crates" and path.parts[2:] == ("src", "lib.rs")]


@pytest.mark.parametrize("document", PRESENT)
def test_rust_names_exist(document):
    """`crate::module::Name` is a module or an item; what comes after an item (a method, a variant) is not looked up."""
    missing = []
    for span in code_spans(document):
        name = re.match(rf"^({'|'.join(CRATES)})((?:::\w+)+)", span)
        if name and not crate(name[1]).resolve((), tuple(name[2].split("::")[1:])):
            missing.append(span)
    assert not missing


# --- Commands ------------------------------------------------------------------------------------------------------


@functools.cache
def help_of(command):
    return subprocess.run([RIGD, *command, "--help"], capture_output=True, text=True, check=True).stdout


@functools.cache
def subcommands(command):
    listed = re.search(r"^Commands:\n((?:  .*\n)+)", help_of(command), re.MULTILINE)
    return set(re.findall(r"^  (\w[\w-]*)", listed[1], re.MULTILINE)) if listed else set()


def command_lines(document):
    """Each `rigd …` of a document: of blocks for the console, of indented ones, and of spans."""
    content = (ROOT / document).read_text(encoding="utf-8")
    lines = [line for kind, block in FENCE.findall(content) if kind == "console" for line in block.splitlines()]
    lines += re.findall(r"^ {4}(rigd .*)$", text_of(document), re.MULTILINE)
    lines += [span for span in code_spans(document) if span.startswith("rigd ")]
    for line in lines:
        line = re.sub(r"\s#.*|^\$ |[|>]{1}\s.*", "", line.replace("cargo run --release -p rigd --", "rigd")).strip()
        if line.startswith("rigd "):
            yield line


def unknown_in(line):
    """The first word of a command line that the program does not know, or None."""
    command = ()
    for word in line.replace("[", " ").replace("]", " ").split()[1:]:
        if word.startswith("--"):
            option = word.split("=")[0].rstrip(".,;")
            if option != "--help" and not re.search(rf"(^|[\s,]){re.escape(option)}\b(?!-)", help_of(command), re.MULTILINE):
                return word
        elif (names := subcommands(command)) and (first := word.split("|")[0].rstrip(".,;")):
            if re.fullmatch(r"…|[A-Z]+", first):
                return None
            if first not in names:
                return word
            command = (*command, first)
    return None


@pytest.mark.parametrize("document", DOCUMENTS)
def test_command_lines_are_of_the_program(document):
    assert {line: word for line in command_lines(document) if (word := unknown_in(line))} == {}


def test_unknown_commands_and_options_are_seen():
    assert unknown_in("rigd run --load 10Nm --rpm 5") is None
    assert unknown_in("rigd run --lode 10Nm") == "--lode"
    assert unknown_in("rigd model te pair.toml --method exact") is None
    assert unknown_in("rigd model tea pair.toml") == "tea"
    assert unknown_in("rigd measure") == "measure"


# --- Samples -------------------------------------------------------------------------------------------------------

samples = script("samples")


@pytest.mark.parametrize("path", samples.documents(), ids=lambda path: path.name)
def test_samples_are_what_the_program_prints(path):
    faults = []
    samples.renew(path.read_text(encoding="utf-8"), faults)
    assert not faults, "\n".join(["made anew by scripts/samples.py", *faults])


def test_a_sample_that_differs_is_seen_and_made_anew():
    document = "# A\n\n<!-- file: a.txt -->\n```text\nrms 12.0 mm\nx\n```\n\n<!-- output of: cat a.txt -->\n```text\n%s\n```\n"
    for right in ["rms 12.0 mm\nx", "rms 12.1 mm\nx", "rms 12.0 mm\n…"]:
        samples.renew(document % right, faults := [])
        assert not faults
    for wrong in ["rms 12.3 mm\nx", "rms 12.0 um\nx", "rms 12.0 mm", "rms 11.0 mm\n…"]:
        new = samples.renew(document % wrong, faults := [])
        assert len(faults) == 1
        shown = "rms 12.0 mm\n…" if wrong.endswith("…") else "rms 12.0 mm\nx"
        assert new == document % shown


def keys(value):
    """Every key of a JSON value, whatever holds it."""
    if isinstance(value, list):
        return set().union(*map(keys, value))
    return set(value).union(*map(keys, value.values())) if isinstance(value, dict) else set()


def asked(*command):
    printed = json.loads(subprocess.run([RIGD, *command, "--json"], capture_output=True, text=True).stdout)
    return printed.pop("schema"), printed


def test_audit_and_export_say_what_the_document_of_the_log_says(tmp_path):
    text = re.sub(r"\s+", " ", text_of("docs/log.md"))
    quick = ["--load", "10Nm", "--rpm", "20", "--revs", "1", "--direction", "ccw"]
    subprocess.run([RIGD, "run", *quick, "--out", tmp_path], check=True, capture_output=True)
    log, cut = next(tmp_path.glob("*.mcap")), tmp_path / "cut.mcap"
    cut.write_bytes(log.read_bytes()[:-2000])
    schema, audit = asked("audit", cut)
    shape = re.search(rf"`{schema}` (\{{.*?\]\}})(?=, with kinds)", text)[1]
    assert keys(audit) == set(re.findall(r"\w+", shape))
    schema, export = asked("export", log, "--to", "csv", "--out", tmp_path / "table.csv")
    assert f"`{schema}`" in text and f"`{', '.join(export['columns'])}`" in text
