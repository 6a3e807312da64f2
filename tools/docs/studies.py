"""Measures the tables of README.md and docs/ again, and lists the tables that are older than their code.

    studies.py run NAME [DATA…] --partprobe PROGRAM     measures a study and writes its block into its page
    studies.py list                                     prints one line per study: up to date, or how many commits are newer
    studies.py plots                                    draws the plots of all blocks again

Input: `docs/studies.toml`, which names the page, the commands, the configs and the code of each study; and the git history.
Output: `run` replaces the block in the page, and draws its plots from its tables. `list` prints the lines.
Exit status: `list` exits with 1 only if a block is missing or cannot be read, or a plot is not that of its table.

A block contains the date, the commit, and the first twelve digits of the SHA-256 of its configs and of its data. `run` refuses to measure
if the code of the study has uncommitted changes, because no commit would then identify what was measured.
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

import forest

ROOT = pathlib.Path(__file__).resolve().parents[2]
STAMP = re.compile(r"Measured on (\S+) at commit `([0-9a-f]{12})`, configs `([0-9a-f]{12})`")
# The content of a block that was measured before blocks recorded their commit.
UNRECORDED = "*Old: measured before commits were recorded.*"
# The content of a block whose study exists but was not run yet.
NOT_MEASURED = "*Not measured yet.*"


def git(*arguments):
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"git {' '.join(arguments)}: {done.stderr.strip()}")
    return done.stdout.strip()


def digest_of_files(files):
    """Returns twelve hexadecimal digits of a hash over the names and the bytes of files, wherever the files are."""
    total = hashlib.sha256()
    for name, file in files:
        total.update(f"{name}\0{hashlib.sha256(file.read_bytes()).hexdigest()}\n".encode())
    return total.hexdigest()[:12]


def files_of(data):
    """Yields all files below the given paths, in order, each with its name relative to the given path."""
    for given in data:
        path = pathlib.Path(given)
        inside = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
        for file in inside:
            yield (file.relative_to(path.parent).as_posix(), file)


def config_digest(study):
    """Returns the digest of the configs of a study."""
    return digest_of_files((name, ROOT / name) for name in study["configs"])


def block_pattern(name):
    """Returns the pattern of the block of a study. Its second group is the content."""
    return re.compile(rf"(<!-- study: {re.escape(name)} -->\n)(.*?)(<!-- end of study -->)", re.DOTALL)


def tables_of(text, count):
    """Returns the first `count` tables of a Markdown text, each with the paragraph before it; the whole text if `count` is `None`."""
    if count is None:
        return text.strip()
    paragraphs = text.strip().split("\n\n")
    places = [index for index, paragraph in enumerate(paragraphs) if paragraph.lstrip().startswith("|")]
    return "\n\n".join(paragraphs[: places[count - 1] + 1])


def measure(study, data, partprobe, out):
    """Runs the commands of a study, and returns the Markdown for its block."""
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
    """Returns the first line of a block: date, commit, digests, and the command that measures it."""
    today = datetime.date.today().isoformat()
    commit = git("rev-parse", "HEAD")[:12]
    text = f"*Measured on {today} at commit `{commit}`, configs `{config_digest(study)}`"
    if data:
        files = list(files_of(data))
        text += f", data `{digest_of_files(files)}` ({len(files)} files)"
    shown = " ".join(["just study", name, *(pathlib.Path(given).name for given in data)])
    return f"{text}, by `{shown}`.*"


def run(name, study, arguments):
    """Measures a study and writes its block into its page."""
    if bool(study.get("data")) != bool(arguments.data):
        raise SystemExit(f"{name} expects this data: {study.get('data', 'nothing')}")
    changed = git("status", "--porcelain", "--", *study["code"], *study["configs"])
    if changed:
        raise SystemExit(f"commit these changes first, so that a commit identifies what is measured:\n{changed}")
    page = ROOT / study["page"]
    if not block_pattern(name).search(page.read_text()):
        raise SystemExit(f"{study['page']} has no block `<!-- study: {name} -->`")
    # The stamp is made before the measurement, because commits that are made during the measurement are not part of it.
    first_line = stamp(name, study, arguments.data)
    with tempfile.TemporaryDirectory(prefix="study-") as scratch:
        out = arguments.out or pathlib.Path(scratch)
        measured = measure(study, arguments.data, arguments.partprobe.resolve(), out)
    block = f"{first_line}\n\n{measured}\n"
    page.write_text(block_pattern(name).sub(lambda found: found[1] + block + found[3], page.read_text()))
    print(f"{study['page']}: the block `{name}` was written", file=sys.stderr)
    write_plots(name, study)


def plots_of(name, study):
    """Yields the file and the text of each plot of a study, drawn from the tables of its block."""
    if not study.get("plots"):
        return
    block = block_pattern(name).search((ROOT / study["page"]).read_text())
    tables = list(forest.tables(block[2]))
    for plot in study["plots"]:
        yield ROOT / plot["file"], forest.forest(tables[plot["table"] - 1], plot["column"], plot["rows"], plot["caption"])


def write_plots(name, study):
    """Draws the plots of a study."""
    for file, svg in plots_of(name, study):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(svg)


def overlaid(lower, upper):
    """Returns one table of settings over another. A table replaces the other one, instead of being merged, if its `type` differs."""
    merged = dict(lower)
    for key, value in upper.items():
        below = merged.get(key)
        is_same = isinstance(below, dict) and isinstance(value, dict) and value.get("type", below.get("type")) == below.get("type")
        merged[key] = overlaid(below, value) if is_same else value
    return merged


def merged_config(name, read):
    """Returns a config merged over all configs that it is based on. `read` returns the text of a file."""
    own = tomllib.loads(read(name))
    base = own.pop("base", None)
    return overlaid(merged_config(f"configs/{base}", read), own) if base else own


def have_other_values(study, commit):
    """Returns whether the settings of a study differ from those at a commit.

    Comments do not count. It does not matter either which config of the chain contains a value.
    """

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
    """Returns the text that `list` prints for a study, and whether its block can be read."""
    found = block_pattern(name).search((ROOT / study["page"]).read_text())
    if not found:
        return "the block is missing", False
    if NOT_MEASURED in found[2]:
        return "not measured yet", True
    if UNRECORDED in found[2]:
        return "old: measured before commits were recorded", True
    stamped = STAMP.search(found[2])
    if not stamped:
        return "the line with date, commit and configs is missing", False
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
    """Prints the state of every study, and returns the exit status."""
    readable = True
    for name, study in studies.items():
        text, ok = state_of(name, study)
        print(f"{study['page']}, {name}: {text}")
        readable &= ok
        for file, svg in plots_of(name, study):
            if not file.exists() or file.read_text() != svg:
                print(f"{file.relative_to(ROOT)}: this is not the plot of its table; draw it again with `studies.py plots`")
                readable = False
    blocks = {(page.relative_to(ROOT).as_posix(), name) for page in pages() for name in named_blocks(page)}
    for page, name in sorted(blocks - {(study["page"], name) for name, study in studies.items()}):
        print(f"{page}, {name}: this block is not in docs/studies.toml")
        readable = False
    return 0 if readable else 1


def pages():
    """Returns the pages that may contain blocks."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def named_blocks(page):
    """Returns the names of the blocks of a page."""
    return re.findall(r"<!-- study: (\S+) -->", page.read_text())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True)
    verbs.add_parser("list")
    verbs.add_parser("plots")
    runner = verbs.add_parser("run")
    runner.add_argument("name")
    runner.add_argument("data", nargs="*")
    runner.add_argument("--partprobe", type=pathlib.Path, default=ROOT / "target/release/partprobe")
    runner.add_argument("--out", type=pathlib.Path, help="folder for the files that the commands write (default: a temporary folder)")
    arguments = parser.parse_args()
    studies = tomllib.loads((ROOT / "docs/studies.toml").read_text())
    if arguments.verb == "list":
        return list_states(studies)
    if arguments.verb == "plots":
        for name, study in studies.items():
            write_plots(name, study)
        return 0
    if arguments.name not in studies:
        parser.error(f"there is no study {arguments.name!r}; the studies are {', '.join(studies)}")
    return run(arguments.name, studies[arguments.name], arguments)


if __name__ == "__main__":
    sys.exit(main())
