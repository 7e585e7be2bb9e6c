#!/usr/bin/env python3
"""Wraps the documents at 120 columns, so that a diff of them can be read: scripts/wrap_docs.py [--check] [FILE...]

Paragraphs and list items are filled anew; headings, tables, code, HTML and quotations stay as they are. What is rendered
does not change: code spans are never broken, and no line begins with what would be taken for markup there. Without FILE
it takes every document of the repository, fixtures left out. --check writes nothing, and exits with 1 where a document
is not as it would be written.
"""

import os
import re
import sys
from pathlib import Path

WIDTH = 120

FENCE = re.compile(r"^ *(```|~~~)")
VERBATIM = re.compile(r"^( {4,}|\t| {0,3}(\||#{1,6} |<|>|(\* *){3,}$|(- *){3,}$|(_ *){3,}$|\[[^\]]+\]: ))")
ITEM = re.compile(r"^( *)([-*+]|\d{1,9}[.)])( +)")
# A code span within a word is part of the word, whatever blanks it has.
WORD = re.compile(r"(?:(`+)(?!`).*?(?<!`)\1(?!`)|[^ ])+")
# At the beginning of a line these would be a list, a heading, a table, a quotation, HTML or the underline of a heading.
MARKUP = re.compile(r"^([-*+]$|#{1,6}$|\d{1,9}[.)]$|[>|<]|=+$|-+$|```|~~~)")
THOUSANDS = re.compile(r"\d{3}\b")


def words(text: str) -> list[str]:
    """The pieces of a paragraph between which a line may end: words, and whole code spans."""
    glued: list[str] = []
    for match in WORD.finditer(text):
        piece = match.group()
        if glued and (MARKUP.match(piece) or (glued[-1][-1].isdigit() and THOUSANDS.match(piece))):
            glued[-1] += " " + piece
        else:
            glued.append(piece)
    return glued


def fill(text: str, first: str, rest: str) -> list[str]:
    """`text` in lines of at most WIDTH characters, the first one indented by `first` and the others by `rest`."""
    lines, line = [], first
    for number, word in enumerate(words(text)):
        if number and len(line) + 1 + len(word) > WIDTH and line.strip():
            lines.append(line)
            line = rest + word
        else:
            line += (" " if number else "") + word
    return [*lines, line]


def wrap(document: str) -> str:
    """The document with its paragraphs and list items filled anew."""
    out: list[str] = []
    text: list[str] = []  # the lines of the paragraph under way
    first = rest = ""  # what its first line and its further lines begin with
    fenced = in_list = False

    def end_paragraph() -> None:
        if text:
            out.extend(fill(" ".join(text), first, rest))
            text.clear()

    for line in document.splitlines():
        if FENCE.match(line):
            end_paragraph()
            fenced = not fenced
            out.append(line)
        elif fenced:
            out.append(line)
        elif not line.strip():
            end_paragraph()
            out.append("")
        elif (item := ITEM.match(line)) and (len(item.group(1)) < 4 or in_list):
            end_paragraph()
            in_list = True
            first = item.group(0)
            rest = " " * len(first)
            text.append(line[len(first) :].strip())
        elif VERBATIM.match(line) and not text:
            in_list = in_list and line.startswith(" ")
            out.append(line)
        elif re.match(r"^ {0,3}(\||#{1,6} |<!--)", line):
            end_paragraph()
            out.append(line)
        else:
            if not text:
                first = rest = line[: len(line) - len(line.lstrip())]
                in_list = in_list and bool(first)
            text.append(line.strip())
            if line.endswith(("  ", "\\")):  # a line break that is meant
                end_paragraph()
                out[-1] += line[len(line.rstrip()) :]
                first = rest
    end_paragraph()
    return "\n".join(out) + "\n"


def documents() -> list[Path]:
    """Every document of the repository, fixtures left out."""
    found = []
    for folder, folders, files in os.walk(Path(__file__).resolve().parent.parent):
        folders[:] = [name for name in folders if name not in ("target", "fixtures", "runs") and not name.startswith(".")]
        found += [Path(folder, name) for name in files if name.endswith(".md")]
    return sorted(found)


def main() -> int:
    check = "--check" in sys.argv
    changed = 0
    for path in [Path(name) for name in sys.argv[1:] if name != "--check"] or documents():
        old = path.read_text(encoding="utf-8")
        if (new := wrap(old)) != old:
            changed += 1
            print(f"{path}: {'not wrapped; run scripts/wrap_docs.py' if check else 'wrapped'}")
            if not check:
                path.write_text(new, encoding="utf-8")
    return int(check and changed > 0)


if __name__ == "__main__":
    sys.exit(main())
