"""Checks the relative links of README.md, ARCHITECTURE.md, CONTRIBUTING.md and docs/.

    links.py

Each link must lead to a file, and to a heading of that file if it names one. A page in docs/ may link only to files in docs/, since the
book contains no other files. Every page in docs/ must be in docs/SUMMARY.md. Links to other sites are not checked.
Output: one line per problem, and a count.
Exit status: 1 if there is a problem.
"""

import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
CODE = re.compile(r"```.*?```|`[^`\n]*`", re.DOTALL)


def anchor_of(heading):
    """Returns the anchor that GitHub and mdBook give to a heading."""
    text = LINK.sub(lambda link: link[0][1 : link[0].index("]")], heading).replace("`", "").strip().lower()
    return re.sub(r"[^\w\- ]", "", text).replace(" ", "-")


def anchors_of(page):
    """Returns the anchors of all headings of a page."""
    text = re.sub(r"```.*?```", "", page.read_text(), flags=re.DOTALL)
    return {anchor_of(heading) for heading in re.findall(r"^#+ (.*)$", text, re.MULTILINE)}


def problem_of(page, target):
    """Returns what is wrong with a link, or `None` if the link is right."""
    path, _, anchor = target.partition("#")
    file = (page.parent / path).resolve() if path else page
    if not file.exists():
        return "there is no such file"
    if page.is_relative_to(DOCS) and not file.is_relative_to(DOCS):
        return "the file is not part of the book; name it without a link"
    if anchor and anchor not in anchors_of(file):
        return "the page has no such heading"
    return None


def main():
    pages = [ROOT / name for name in ("README.md", "ARCHITECTURE.md", "CONTRIBUTING.md")] + sorted(DOCS.rglob("*.md"))
    n_broken = 0
    listed = {(DOCS / target).resolve() for target in LINK.findall((DOCS / "SUMMARY.md").read_text())}
    for page in pages:
        name = page.relative_to(ROOT)
        if page.is_relative_to(DOCS) and page.name != "SUMMARY.md" and page not in listed:
            print(f"{name}: the page is not in docs/SUMMARY.md")
            n_broken += 1
        for target in LINK.findall(CODE.sub("", page.read_text())):
            problem = None if re.match(r"[a-z]+:", target) else problem_of(page, target)
            if problem:
                print(f"{name}: {target}: {problem}")
                n_broken += 1
    print(f"links: {len(pages)} pages, {n_broken} problems")
    return int(n_broken > 0)


if __name__ == "__main__":
    sys.exit(main())
