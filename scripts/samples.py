#!/usr/bin/env python3
"""Makes the sample outputs in the documents anew, or checks them: scripts/samples.py [--check] [FILE...]

A document says by comments what is real; each document has a directory of its own that is thrown away:

    <!-- run -->                  the commands in the block that follows are run
    <!-- file: NAME -->           the block that follows is written to NAME
    <!-- output of: COMMAND -->   the block that follows is what COMMAND prints; where its last line is "…", its first lines

`rigd` is $RIGD (target/release/rigd without it), `python` the one that runs this. The simulated rig prints the same for
the same seed. --check writes nothing and exits with 1 where a sample differs: words must be equal, numbers within 1 %
or one step of their last digit, for two machines need not round alike.
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SAMPLE = re.compile(
    r"^<!-- (?P<what>run|file|output of)(?:: (?P<argument>.*?))? -->\n(?P<fence>```\w*\n)(?P<block>.*?)(?P<end>^```)",
    re.MULTILINE | re.DOTALL,
)
NUMBER = re.compile(r"\d+(?:\.(\d+))?(?:e[+-]?\d+)?")
TOLERANCE = 0.01


def shell(command: str, folder: Path, strict: bool) -> str:
    """What the commands print, run in `folder`; a strict one must succeed."""
    bin = folder / ".bin"
    if not bin.exists():
        bin.mkdir()
        (bin / "rigd").symlink_to(Path(os.environ.get("RIGD", ROOT / "target/release/rigd")).resolve())
        (bin / "python").write_text(f'#!/bin/sh\nexec "{sys.executable}" "$@"\n')
        (bin / "python").chmod(0o755)
    environment = {**os.environ, "PATH": f"{bin}:{os.environ['PATH']}"}
    done = subprocess.run(["bash", "-ec", command], cwd=folder, capture_output=True, text=True, env=environment)
    if (strict and done.returncode) or not (strict or done.stdout):
        sys.exit(f"samples: `{command}` ended with {done.returncode}:\n{done.stderr}")
    return done.stdout


def shown(printed: str, block: str) -> str:
    """As much of what a command printed as the sample shows."""
    lines = [line.rstrip() for line in printed.rstrip("\n").splitlines()]
    sample = block.splitlines()
    if sample and sample[-1] == "…":
        lines = [*lines[: len(sample) - 1], "…"]
    return "\n".join(lines) + "\n"


def same(sample: str, printed: str) -> bool:
    """Whether words are equal and numbers near enough."""
    if NUMBER.sub("0", sample) != NUMBER.sub("0", printed):
        return False
    for one, two in zip(NUMBER.finditer(sample), NUMBER.finditer(printed)):
        step = 10.0 ** -len(one[1] or "")
        if abs(float(one[0]) - float(two[0])) > max(TOLERANCE * float(one[0]), 1.01 * step):
            return False
    return True


def renew(document: str, faults: list[str]) -> str:
    """The document with its samples made anew; what differs is told in `faults`."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)

        def sample(match: re.Match) -> str:
            what, argument, block = match["what"], match["argument"], match["block"]
            if what == "run":
                shell(block, folder, strict=True)
            elif what == "file":
                (folder / argument).write_text(block, encoding="utf-8")
            else:
                printed = shown(shell(argument, folder, strict=False), block)
                if not same(block, printed):
                    faults.append(f"`{argument}` prints\n{printed}and not\n{block}")
                    head = match[0][: match.start("block") - match.start()]
                    return head + printed + match["end"]
            return match[0]

        return SAMPLE.sub(sample, document)


def documents() -> list[Path]:
    """The documents that have samples."""
    return [path for path in [ROOT / "README.md", *sorted(ROOT.glob("docs/**/*.md"))] if "<!-- output of:" in path.read_text("utf-8")]


def main() -> int:
    check, different = "--check" in sys.argv, 0
    for path in [Path(name) for name in sys.argv[1:] if name != "--check"] or documents():
        faults: list[str] = []
        new = renew(path.read_text(encoding="utf-8"), faults)
        different += len(faults)
        for fault in faults:
            print(f"{path}: {fault}")
        if faults and not check:
            path.write_text(new, encoding="utf-8")
    return int(check and different > 0)


if __name__ == "__main__":
    sys.exit(main())
