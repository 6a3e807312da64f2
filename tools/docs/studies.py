"""Measures the tables of docs/ again, and says which of them are older than the code under them.

    studies.py run NAME [DATA…] --partprobe PROGRAM     measures a study and writes its block into its page
    studies.py list                                     one line per study: up to date, or older than which commits

In: `docs/studies.toml`, which names the page, the commands, the configs and the code of each study; the git history.
Out: the page with its block renewed (`run`), or a table (`list`, which fails only if a block is missing or unreadable).

A block says when it was measured, at which commit, and the first twelve digits of the SHA-256 of its configs and of its
data. `run` refuses to measure while the code of the study has changes that are not committed, since no commit would name it.
"""

import argparse
import datetime
import hashlib
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
import tomllib

ROOT = pathlib.Path(__file__).resolve().parents[2]
STAMP = re.compile(r"Measured on (\S+) at commit `([0-9a-f]{12})`, configs `([0-9a-f]{12})`")
# Blocks of the time before commits were recorded.
UNRECORDED = "*Old: measured before commits were recorded.*"
# Blocks of studies that are described and can be run, but were not run yet.
NOT_MEASURED = "*Not measured yet.*"


def git(*arguments):
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"git {' '.join(arguments)}: {done.stderr.strip()}")
    return done.stdout.strip()


def digest_of_files(files):
    """Twelve hexadecimal digits over the names and bytes of files, in any folder."""
    total = hashlib.sha256()
    for name, file in files:
        total.update(f"{name}\0{hashlib.sha256(file.read_bytes()).hexdigest()}\n".encode())
    return total.hexdigest()[:12]


def files_of(data):
    """The files below the given paths with their names from there, in order."""
    for given in data:
        path = pathlib.Path(given)
        inside = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
        for file in inside:
            yield (file.relative_to(path.parent).as_posix(), file)


def config_digest(study):
    return digest_of_files((name, ROOT / name) for name in study["configs"])


def block_pattern(name):
    return re.compile(rf"(<!-- study: {re.escape(name)} -->\n)(.*?)(<!-- end of study -->)", re.DOTALL)


def tables_of(text, count):
    """The first `count` tables of a Markdown text, each with the paragraph before it; all of it if `count` is `None`."""
    if count is None:
        return text.strip()
    paragraphs = text.strip().split("\n\n")
    places = [index for index, paragraph in enumerate(paragraphs) if paragraph.lstrip().startswith("|")]
    return "\n\n".join(paragraphs[: places[count - 1] + 1])


def measure(study, data, partprobe, out):
    """Runs the commands of a study; the Markdown that its block will hold."""
    words = {"data": " ".join(map(shlex.quote, data)), "out": str(out), "partprobe": str(partprobe)}
    for number, name in enumerate(("first", "second", "third", "fourth")):
        words[name] = shlex.quote(data[number]) if number < len(data) else ""
    words["rest"], words["after_third"] = (" ".join(map(shlex.quote, data[after:])) for after in (1, 3))
    output = ""
    for command in study["commands"]:
        command = command.format(**words)
        print(command, file=sys.stderr)
        done = subprocess.run(["bash", "-euo", "pipefail", "-c", command], cwd=ROOT, stdout=subprocess.PIPE, text=True)
        if done.returncode != 0:
            raise SystemExit(f"exit status {done.returncode}: {command}")
        output = done.stdout
    result = study["result"].format(**words)
    return tables_of(output if result == "stdout" else pathlib.Path(result).read_text(), study.get("tables"))


def stamp(name, study, data):
    today = datetime.date.today().isoformat()
    commit = git("rev-parse", "HEAD")[:12]
    text = f"*Measured on {today} at commit `{commit}`, configs `{config_digest(study)}`"
    if data:
        files = list(files_of(data))
        text += f", data `{digest_of_files(files)}` ({len(files)} files)"
    shown = " ".join(["just study", name, *(pathlib.Path(given).name for given in data)])
    return f"{text}, by `{shown}`.*"


def run(name, study, arguments):
    if bool(study.get("data")) != bool(arguments.data):
        raise SystemExit(f"{name} takes as data: {study.get('data', 'nothing')}")
    changed = git("status", "--porcelain", "--", *study["code"], *study["configs"])
    if changed:
        raise SystemExit(f"commit these first, so that a commit names what is measured:\n{changed}")
    page = ROOT / study["page"]
    if not block_pattern(name).search(page.read_text()):
        raise SystemExit(f"{study['page']} has no block `<!-- study: {name} -->`")
    # Before the measurement: what is committed while it runs was not measured.
    first_line = stamp(name, study, arguments.data)
    with tempfile.TemporaryDirectory(prefix="study-") as scratch:
        out = arguments.out or pathlib.Path(scratch)
        measured = measure(study, arguments.data, arguments.partprobe.resolve(), out)
    block = f"{first_line}\n\n{measured}\n"
    page.write_text(block_pattern(name).sub(lambda found: found[1] + block + found[3], page.read_text()))
    print(f"{study['page']}: the block `{name}` is new", file=sys.stderr)


def overlaid(lower, upper):
    """One table of settings over another. A table with a `type` replaces one of another type."""
    merged = dict(lower)
    for key, value in upper.items():
        below = merged.get(key)
        is_same = isinstance(below, dict) and isinstance(value, dict) and value.get("type", below.get("type")) == below.get("type")
        merged[key] = overlaid(below, value) if is_same else value
    return merged


def merged_config(name, read):
    """A config over all that it builds on. `read` gives the text of a file."""
    own = tomllib.loads(read(name))
    base = own.pop("base", None)
    return overlaid(merged_config(f"configs/{base}", read), own) if base else own


def have_other_values(study, commit):
    """Whether an experiment says something else than at a commit: comments do not count, nor which file of its chain says a value."""

    def read_then(name):
        done = subprocess.run(["git", "show", f"{commit}:{name}"], cwd=ROOT, capture_output=True, text=True)
        if done.returncode != 0:
            raise FileNotFoundError(name)
        return done.stdout

    def read_now(name):
        return (ROOT / name).read_text()

    bases = {f"configs/{tomllib.loads(read_now(name)).get('base')}" for name in study["configs"]}
    try:
        return any(merged_config(name, read_then) != merged_config(name, read_now) for name in study["configs"] if name not in bases)
    except FileNotFoundError:
        return True


def state_of(name, study):
    """What `list` says of a study, and whether its block can be read."""
    found = block_pattern(name).search((ROOT / study["page"]).read_text())
    if not found:
        return "the block is missing", False
    if NOT_MEASURED in found[2]:
        return "not measured yet", True
    if UNRECORDED in found[2]:
        return "old: measured before commits were recorded", True
    stamped = STAMP.search(found[2])
    if not stamped:
        return "the line that says date, commit and configs is missing", False
    date, commit, configs = stamped.groups()
    known = subprocess.run(["git", "cat-file", "-e", commit], cwd=ROOT, stderr=subprocess.DEVNULL).returncode == 0
    if not known:
        return f"commit {commit} is not in this history", git("rev-parse", "--is-shallow-repository") == "true"
    since = git("log", "--format=%h", f"{commit}..HEAD", "--", *study["code"]).split()
    notes = []
    if since:
        notes.append(f"older than {len(since)} commits to its code")
    if configs != config_digest(study) and have_other_values(study, commit):
        notes.append("its configs have changed")
    return f"{date}, {commit}: " + ("; ".join(notes) or "up to date"), True


def list_states(studies):
    readable = True
    for name, study in studies.items():
        text, ok = state_of(name, study)
        print(f"{study['page']}, {name}: {text}")
        readable &= ok
    blocks = {(page.relative_to(ROOT).as_posix(), name) for page in pages() for name in named_blocks(page)}
    for page, name in sorted(blocks - {(study["page"], name) for name, study in studies.items()}):
        print(f"{page}, {name}: docs/studies.toml does not know this block")
        readable = False
    return 0 if readable else 1


def pages():
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def named_blocks(page):
    return re.findall(r"<!-- study: (\S+) -->", page.read_text())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True)
    verbs.add_parser("list")
    runner = verbs.add_parser("run")
    runner.add_argument("name")
    runner.add_argument("data", nargs="*")
    runner.add_argument("--partprobe", type=pathlib.Path, default=ROOT / "target/release/partprobe")
    runner.add_argument("--out", type=pathlib.Path, help="keep what the commands write in this folder")
    arguments = parser.parse_args()
    studies = tomllib.loads((ROOT / "docs/studies.toml").read_text())
    if arguments.verb == "list":
        return list_states(studies)
    if arguments.name not in studies:
        parser.error(f"no study {arguments.name!r}; there are {', '.join(studies)}")
    return run(arguments.name, studies[arguments.name], arguments)


if __name__ == "__main__":
    sys.exit(main())
