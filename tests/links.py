"""Checks the Markdown pages of the repository.

Contract: every relative link leads to a file or folder, and every anchor to a heading of its page;
prose lines have at most 100 columns, but for tables, code and lines with a link; the README has at
most 120 lines, a page of results at most 150.

    python3 tests/links.py

It prints a line with file and line number for each problem, and then exits with code 1.
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SKIPPED = {"target", "node_modules"}
MOST_COLUMNS = 100
MOST_LINES = {"README.md": 120, "docs/results": 150}
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
FENCED = re.compile(r"^ *```.*?^ *```", re.M | re.S)
CODE = re.compile(r"`[^`]+`")


def pages():
    """Markdown files of the repository by their paths from its root, with their text."""
    found = (path.relative_to(ROOT) for path in ROOT.rglob("*.md"))
    kept = (path for path in found if not any(part in SKIPPED or part[0] == "." for part in path.parts))
    return {path: (ROOT / path).read_text() for path in sorted(kept)}


def blank(match):
    """Spaces in place of the text of a match, on the same lines and columns."""
    return re.sub(r"[^\n]", " ", match[0])


def anchors(text):
    """Anchors of a page's headings, as GitHub makes them."""
    found = []
    for heading in re.findall(r"^#{1,6} +(.*)$", FENCED.sub(blank, text), re.M):
        shown = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading.strip())
        anchor = re.sub(r"[^\w\- ]", "", shown.lower()).replace(" ", "-")
        copies = sum(1 for other in found if re.fullmatch(re.escape(anchor) + r"(-\d+)?", other))
        found.append(f"{anchor}-{copies}" if copies else anchor)
    return found


def fault(page, link, texts):
    """The fault of a link on a page, or None. Links to other sites are not followed."""
    if re.match(r"[a-z][a-z0-9+.-]*:", link):
        return None
    path, _, anchor = link.partition("#")
    target = (ROOT / page.parent / path).resolve() if path else ROOT / page
    if not target.is_relative_to(ROOT) or not target.exists():
        return f"{link}: expected a file or folder of the repository, found none"
    if anchor and anchor not in anchors(texts.get(target.relative_to(ROOT), "")):
        return f"{link}: expected a heading with this anchor, found none"
    return None


def faults(page, text, texts):
    """Lines and faults of a page."""
    most = MOST_LINES.get(str(page)) or MOST_LINES.get(str(page.parent))
    lines = text.splitlines()
    if most and len(lines) > most:
        yield most + 1, f"expected at most {most} lines, found {len(lines)}"
    outside = FENCED.sub(blank, text)
    prose = CODE.sub(blank, outside)
    linked = set()
    for match in LINK.finditer(prose):
        first, last = (prose.count("\n", 0, at) + 1 for at in match.span())
        linked.update(range(first, last + 1))
        found = fault(page, match[1], texts)
        if found:
            yield last, found
    for number, line in enumerate(outside.splitlines(), 1):
        is_prose = number not in linked and not line.lstrip().startswith("|")
        if is_prose and len(line.rstrip()) > MOST_COLUMNS:
            yield number, f"expected at most {MOST_COLUMNS} columns, found {len(line.rstrip())}"


def main():
    texts = pages()
    found = [(page, *where) for page, text in texts.items() for where in faults(page, text, texts)]
    for page, number, words in found:
        print(f"{page}:{number}: {words}")
    print(f"{len(texts)} pages, {len(found)} faults")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
