"""Opens the report of a run in headless Chromium, and checks that everything on the page works.

    check_page.py REPORT.html [--chromium PROGRAM] [--screenshots DIR]

Input: a report.html with test shapes.
Output: one line per check on stdout. With `--screenshots`, also pictures of each section: light and dark, wide and narrow.
Exit status: 1 if a check fails.
Needs playwright (pip) and a Chromium (apt-get install chromium).

The script checks that:

- the file is not too large;
- the console shows no message, no script fails, and the page requests no other file;
- every table can be sorted by every column and can be filtered;
- the panes of the 3D view and the pictures of the cards are not blank;
- dragging and the arrow keys rotate all panes;
- pointing at the surface shows the name of a part, and of a face if faces are known;
- a click selects a part, and Escape ends the selection;
- no section is wider than a narrow window.
"""

import argparse
import pathlib
import shutil
import sys

from playwright.sync_api import sync_playwright

MAX_BYTES = 25_000_000
# A machine without a graphics card draws WebGL in software.
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
WIDE, NARROW = {"width": 1280, "height": 900}, {"width": 390, "height": 844}

# Returns one column of a table, in the order that is shown. The values are the numbers by which the table is sorted.
COLUMN = """([id, column]) => [...document.getElementById(id).tBodies[0].rows].map((row) => {
    const cell = row.children[column];
    return cell.dataset.v === undefined ? null : Number(cell.dataset.v);
})"""

# Returns, for each pane, the fraction of its pixels that are painted, the number of colors, and a checksum of the picture.
PANES = """() => {
    const canvas = document.getElementById('view-canvas');
    const copy = document.createElement('canvas');
    [copy.width, copy.height] = [canvas.width, canvas.height];
    const context = copy.getContext('2d');
    context.drawImage(canvas, 0, 0);
    const outer = canvas.getBoundingClientRect();
    const ratio = canvas.width / outer.width;
    return [...document.querySelectorAll('.pane')].map((pane) => {
        const box = pane.getBoundingClientRect();
        const at = [box.left - outer.left, box.top - outer.top, box.width, box.height].map((x) => Math.round(x * ratio));
        const data = context.getImageData(...at).data;
        const colors = new Set();
        let [painted, sum] = [0, 0];
        for (let i = 0; i < data.length; i += 4) {
            if (data[i + 3] === 0) continue;
            painted += 1;
            colors.add(data[i] << 16 | data[i + 1] << 8 | data[i + 2]);
            sum = (sum * 31 + (data[i] + i) * (data[i + 1] + 7)) % 1000000007;
        }
        return { share: 4 * painted / data.length, colors: colors.size, sum };
    });
}"""

PICTURES = """() => [...document.querySelectorAll('.card:not([hidden]) canvas')].slice(0, 8).map((canvas) => {
    const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
    let painted = 0;
    for (let i = 3; i < data.length; i += 4) painted += data[i] > 0;
    return 4 * painted / data.length;
})"""


DRAWN = "!!document.getElementById('view-canvas').dataset.drawn"


class Checks:
    """Prints the result of each check, and counts the failures."""

    def __init__(self):
        self.n_failed = 0

    def check(self, holds, what, found=""):
        self.n_failed += not holds
        print(f"{'ok' if holds else 'FAILED'}: {what}{f' ({found})' if found != '' else ''}")


def wait_until(page, expression, what):
    """Waits until an expression is true. The content policy of the page forbids a script that waits, so this function polls."""
    for _ in range(600):
        if page.evaluate(expression):
            return
        page.wait_for_timeout(100)
    sys.exit(f"FAILED: {what} did not happen within a minute")


def scroll_to(page, element):
    """Scrolls to an element at once, without an animation."""
    page.evaluate(
        "id => window.scrollTo({ top: document.getElementById(id).getBoundingClientRect().top + scrollY - 56, behavior: 'instant' })",
        element,
    )
    page.wait_for_timeout(300)


def is_sorted(values, descending):
    """Returns whether numbers are in order, with the missing ones last."""
    numbers = [value for value in values if value is not None]
    missing_last = values[: len(numbers)] == numbers
    return missing_last and numbers == sorted(numbers, reverse=descending)


def check_tables(page, checks):
    """Checks that tables can be sorted and filtered."""
    tables = page.eval_on_selector_all("table.sortable", "tables => tables.map((table) => table.id)")
    checks.check(bool(tables), "there are tables", len(tables))
    page.evaluate("document.querySelectorAll('details').forEach((details) => { details.open = true; })")
    for table in tables:
        buttons = page.locator(f"#{table} thead button")
        wrong = []
        for column in range(buttons.count()):
            name = buttons.nth(column).inner_text()
            is_number = page.locator(f"#{table} thead th").nth(column).evaluate("th => th.classList.contains('n')")
            for descending in ([True, False] if is_number else [False, True]):
                # The keyboard must work too, for readers without a mouse.
                buttons.nth(column).press("Enter")
                if is_number:
                    holds = is_sorted(page.evaluate(COLUMN, [table, column]), descending)
                else:
                    order = page.locator(f"#{table} thead th").nth(column).get_attribute("aria-sort")
                    holds = order == ("descending" if descending else "ascending")
                if not holds:
                    wrong.append(name)
        checks.check(not wrong, f"table {table} sorts by {buttons.count()} columns", ", ".join(wrong))
    for field in page.locator("input[data-filters]").all():
        table = field.get_attribute("data-filters")
        rows = page.locator(f"#{table} tbody tr")
        word = rows.last.locator("th").inner_text().split()[0]
        field.fill(word)
        shown = page.locator(f"#{table} tbody tr:not([hidden])")
        fits = all(word.lower() in text.lower() for text in shown.all_inner_texts())
        checks.check(0 < shown.count() <= rows.count() and fits, f"table {table} filters", f"{shown.count()} of {rows.count()} rows have {word}")
        field.fill("no row has this text")
        checks.check(shown.count() == 0, f"table {table} filters everything")
        field.fill("")
        checks.check(shown.count() == rows.count(), f"table {table} shows everything again")


def picked_at(page, pane):
    """Moves the pointer over a pane until it is on the surface. Returns the position, or `None` if it never is."""
    box = page.locator(".pane").nth(pane).bounding_box()
    for step in range(1, 200):
        # The positions start in the middle and soon reach every region of the pane.
        x = box["x"] + box["width"] * (0.5 + 0.38 * ((step * 0.618) % 1 - 0.5) * min(1, step / 20))
        y = box["y"] + box["height"] * (0.55 + 0.38 * ((step * 0.414) % 1 - 0.5) * min(1, step / 20))
        page.mouse.move(x, y)
        if page.locator("#picked").get_attribute("data-part"):
            return x, y
    return None


def check_view(page, checks):
    """Checks the 3D view."""
    wait_until(page, DRAWN, "drawing the 3D view")
    scroll_to(page, "panes")
    before = page.evaluate(PANES)
    for number, pane in enumerate(before):
        holds = pane["share"] > 0.02 and pane["colors"] > 10
        checks.check(holds, f"pane {number} is not blank", f"{pane['share']:.2f} of its pixels, {pane['colors']} colors")

    at = picked_at(page, 0)
    text = page.locator("#picked").inner_text()
    checks.check(at is not None and "part " in text, "pointing shows the name of a part", text)
    has_faces = page.evaluate("JSON.parse(document.getElementById('shape-data').textContent)[Number(document.getElementById('shape').value)].faces.length > 0")
    if has_faces:
        checks.check(bool(page.locator("#picked").get_attribute("data-face")), "pointing shows the name of a face")
    if at:
        page.mouse.click(*at)
        page.wait_for_timeout(200)
        checks.check(page.locator("#parts [aria-pressed=true]").count() == 1, "a click selects a part")
        kept = page.evaluate(PANES)
        checks.check(all(a["sum"] != b["sum"] for a, b in zip(before, kept)), "the other parts fade in all panes")
        page.keyboard.press("Escape")
        page.mouse.move(1, 1)
        page.wait_for_timeout(200)
        checks.check(page.evaluate(PANES) == before, "Escape ends the selection")

    box = page.locator(".pane").first.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] / 2 + 90, box["y"] + box["height"] / 2 + 30, steps=5)
    page.mouse.up()
    page.wait_for_timeout(200)
    turned = page.evaluate(PANES)
    checks.check(all(a["sum"] != b["sum"] for a, b in zip(before, turned)), "dragging rotates all panes")
    page.locator("#view-canvas").focus()
    page.keyboard.press("ArrowLeft")
    page.wait_for_timeout(200)
    checks.check(all(a["sum"] != b["sum"] for a, b in zip(turned, page.evaluate(PANES))), "an arrow key rotates all panes")

    former = page.locator("#shape").input_value()
    page.locator("#next-shape" if page.locator("#shape option").last.get_attribute("value") != former else "#previous-shape").click()
    wait_until(page, f"document.getElementById('view-canvas').dataset.drawn !== '{former}'", "drawing another shape")
    checks.check(all(pane["share"] > 0.01 for pane in page.evaluate(PANES)), "another shape can be chosen")


def check_pictures(page, checks):
    """Checks the pictures of the cards and their order."""
    scroll_to(page, "shapes")
    wait_until(page, "document.querySelectorAll('.card:not([hidden]) canvas[data-painted]').length >= 2", "painting pictures")
    page.wait_for_timeout(500)
    shares = [share for share in page.evaluate(PICTURES) if share > 0]
    checks.check(len(shares) >= 2 and min(shares) > 0.01, "pictures are not blank", f"{len(shares)} looked at")
    scores = page.eval_on_selector_all(".card", "cards => cards.map((card) => Number(card.dataset.score))")
    checks.check(scores == sorted(scores), "the worst shape comes first", f"{scores[0]} of {len(scores)}")


def screenshots(browser, url, folder):
    """Writes pictures of each section in both color schemes and both widths."""
    folder.mkdir(parents=True, exist_ok=True)
    for scheme in ["light", "dark"]:
        for name, viewport in [("wide", WIDE), ("narrow", NARROW)]:
            context = browser.new_context(color_scheme=scheme, viewport=viewport)
            page = context.new_page()
            page.goto(url)
            wait_until(page, DRAWN, "drawing the 3D view")
            for section in page.eval_on_selector_all("main > section", "sections => sections.map((section) => section.id)"):
                scroll_to(page, section)
                page.wait_for_timeout(1200 if section in ("shapes", "view") else 100)
                page.screenshot(path=folder / f"{scheme}-{name}-{section}.png")
            context.close()


def is_of_page(message):
    """Returns whether a console message is about the page. Chromium also warns about reading pixels, which only this script does."""
    return "willReadFrequently" not in message


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("report", type=pathlib.Path)
    parser.add_argument("--chromium", default=shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome"))
    parser.add_argument("--screenshots", type=pathlib.Path)
    arguments = parser.parse_args()
    if not arguments.chromium:
        sys.exit("no Chromium was found; install it (apt-get install chromium), or give its path with --chromium")

    checks = Checks()
    size = arguments.report.stat().st_size
    checks.check(size <= MAX_BYTES, "the file has at most 25 MB", f"{size / 1e6:.1f} MB")
    url = arguments.report.resolve().as_uri()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=arguments.chromium, args=FLAGS)
        messages, requests = [], []
        context = browser.new_context(viewport=WIDE, reduced_motion="reduce")
        page = context.new_page()
        # Drawing in software on a busy machine is slow.
        page.set_default_timeout(120_000)
        page.on("console", lambda message: is_of_page(message.text) and messages.append(f"{message.type}: {message.text}"))
        page.on("pageerror", lambda error: messages.append(f"error: {error}"))
        page.on("request", lambda request: requests.append(request.url))
        page.goto(url)
        check_pictures(page, checks)
        check_view(page, checks)
        check_tables(page, checks)
        page.emulate_media(color_scheme="dark")
        page.set_viewport_size(NARROW)
        page.wait_for_timeout(500)
        width = page.evaluate("document.documentElement.scrollWidth")
        checks.check(width <= NARROW["width"], "nothing is wider than a narrow window", f"{width} pixels")
        checks.check(not messages, "no message on the console", "; ".join(messages[:5]))
        others = [other for other in requests if other != url]
        checks.check(not others, "no request except for the page", ", ".join(others[:5]))
        if arguments.screenshots:
            screenshots(browser, url, arguments.screenshots)
        browser.close()
    sys.exit(1 if checks.n_failed else 0)


if __name__ == "__main__":
    main()
