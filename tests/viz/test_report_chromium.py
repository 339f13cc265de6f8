"""The report in a real browser, opened from disk without a network: it asks for nothing, complains of nothing, and answers."""

import contextlib
import itertools
import json
import pathlib
import re
import shutil
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import pyvista
from PIL import Image
from report_run import report_run

from queries import open_run
from queries.images import images
from queries.kernels.luminance import LUMINANCE
from queries.pixel_classes import NO_CLASS, SLOTS, WHOLE, pixel_classes
from viz.report import Shape, write_report
from viz.report.scene import scene_model
from viz.report.tables import short_words

playwright = pytest.importorskip("playwright.sync_api", reason="needs the package playwright")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
if CHROMIUM is None:
    pytest.skip("needs the browser chromium", allow_module_level=True)
ARGUMENTS = [
    *("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
]
PATIENCE = 60_000  # milliseconds: machines that test are busy


class Opened:
    """The report in a page of the browser, and what was seen of it: ``complaints`` of the console, ``requests``."""

    def __init__(self, page: Any, index: pathlib.Path, folder: pathlib.Path) -> None:
        self.page, self.index, self.folder = page, index, folder
        self.complaints: list[str] = []
        self.requests: list[str] = []
        page.on("console", lambda message: message.type == "error" and self.complaints.append(message.text))
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("request", lambda request: self.requests.append(request.url))
        page.set_default_timeout(PATIENCE)
        page.goto(index.as_uri(), wait_until="domcontentloaded")
        self.until("window.pathspaceInspector !== undefined")
        self.until("[...document.images].filter((image) => image.loading !== 'lazy').every((image) => image.complete)")

    def until(self, condition: str) -> None:
        """Wait for a condition. (The page forbids the evaluation of text, by which playwright would wait.)"""
        end = time.monotonic() + PATIENCE / 1000
        while not self.page.evaluate(condition):
            assert time.monotonic() < end, condition
            self.page.wait_for_timeout(20)

    def told(self) -> str:
        """What the inspector says, once it is about another pixel than it said before."""
        before = self.page.evaluate("window.lastTold || 'No pixel is chosen.'")
        self.until(f"document.getElementById('readout').textContent !== {json.dumps(before)}")
        told: str = self.page.evaluate("window.lastTold = document.getElementById('readout').textContent")
        return told

    def center_of(self, x: int, y: int) -> dict[str, float]:
        """Where the middle of a pixel of the whole image lies on the stage."""
        box = self.page.locator("#stage").bounding_box()
        zoom = min(box["width"] / 24, box["height"] / 16)
        return {"x": (box["width"] - 24 * zoom) / 2 + (x + 0.5) * zoom, "y": (box["height"] - 16 * zoom) / 2 + (y + 0.5) * zoom}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[pathlib.Path, pathlib.Path]:
    """A run and its report, with a model."""
    folder = tmp_path_factory.mktemp("chromium")
    path = report_run(folder)
    random = np.random.default_rng(2)
    lines = pyvista.PolyData(random.uniform(-1, 1, (80, 3)).astype(np.float32), lines=np.insert(np.arange(80).reshape(-1, 2), 0, 2, axis=1).ravel())
    lines.cell_data["rgb"] = random.integers(64, 255, (40, 3), np.uint8)
    still = folder / "still.png"
    Image.new("RGB", (40, 30), (200, 10, 10)).save(still)
    with open_run(path) as run:
        model = scene_model(run, "bundles", [Shape(lines, colors="rgb")], "Forty lines.", "Forty lines in the scene", still)
        return path, write_report(run, folder / "report", models=[model])


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield browser
        browser.close()


@contextlib.contextmanager
def page_of(made: tuple[pathlib.Path, pathlib.Path], browser: Any, folder: pathlib.Path) -> Iterator[Opened]:
    """The report in a page of its own; in the end, nothing was complained of, and nothing asked for that lies elsewhere."""
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    context.set_offline(True)
    report = Opened(context.new_page(), made[1], folder)
    yield report
    context.close()
    assert report.complaints == []
    assert len(report.requests) > 3
    assert [url for url in report.requests if not url.startswith(("file:", "data:", "blob:"))] == []


@pytest.fixture
def opened(made: tuple[pathlib.Path, pathlib.Path], browser: Any, tmp_path: pathlib.Path) -> Iterator[Opened]:
    """A page to work with."""
    with page_of(made, browser, tmp_path) as report:
        yield report


@pytest.fixture(scope="module")
def resting(made: tuple[pathlib.Path, pathlib.Path], browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Opened]:
    """A page to look at, shared by tests that press nothing."""
    with page_of(made, browser, tmp_path_factory.mktemp("resting")) as report:
        yield report


@pytest.fixture
def seen(resting: Opened) -> Iterator[Opened]:
    """The shared page, on a screen of the usual size and colors."""
    yield resting
    resting.page.set_viewport_size({"width": 1280, "height": 900})
    resting.page.emulate_media(media="null", color_scheme="null")


def expected(folder: pathlib.Path, x: int, y: int) -> str:
    """What the inspector should say of a pixel, from the run's tables."""
    with open_run(folder) as run:
        found, image = pixel_classes(run), images(run, {"all": "C .* [LOB]"})["all"]
    rgb = image[y, x].astype(np.float64)
    listed = [
        f"{short_words(found.named[number].description, found.named[number].expression)} {100 * part / WHOLE:.2f} %"
        for number, part in zip(found.classes[y, x].tolist(), found.parts[y, x].tolist())
        if number != NO_CLASS
    ]
    if found.parts[y, x, SLOTS]:
        listed.append(f"other classes {100 * found.parts[y, x, SLOTS] / WHOLE:.2f} %")
    numbers = ", ".join(f"{value:.4g}" for value in rgb)
    return f"Pixel ({x}, {y}): radiance {numbers}, luminance {rgb @ np.array(LUMINANCE):.4g}: {'; '.join(listed) or 'no light'}."


def test_the_inspector_answers_a_mouse_and_keys(made: tuple[pathlib.Path, pathlib.Path], opened: Opened) -> None:
    page, folder = opened.page, made[0]
    page.hover("#stage", position=opened.center_of(11, 10))
    told = opened.told()
    assert told == expected(folder, 11, 10)
    assert told.count("%") > 1
    assert page.inner_text("#figure-place") == "11, 10"
    assert page.locator("#shares tr").count() == told.count("%")
    # Keys move the cursor; with shift, by ten, and never off the film
    page.focus("#stage")
    ways = [("ArrowRight", (12, 10)), ("ArrowUp", (12, 9)), ("Shift+ArrowRight", (22, 9)), ("Shift+ArrowDown", (22, 15)), ("ArrowLeft", (21, 15))]
    for key, place in ways:
        page.keyboard.press(key)
        assert opened.told() == expected(folder, *place)
    page.fill("#at-x", "3")
    page.keyboard.press("Tab")
    assert opened.told() == expected(folder, 3, 15)


def test_the_inspector_zooms_and_shows_other_pictures(opened: Opened) -> None:
    page = opened.page

    def zoom() -> int:
        return int(page.inner_text("#zoom").split()[0])

    def seen() -> bytes:
        shot: bytes = page.locator("#stage").screenshot()
        return shot

    page.focus("#stage")
    whole, pictures = zoom(), [seen()]
    page.keyboard.press("+")
    assert zoom() == pytest.approx(1.5 * whole, abs=2)
    pictures.append(seen())
    page.click("[data-do=out]")
    assert zoom() == whole
    page.hover("#stage", position=opened.center_of(4, 4))
    page.mouse.wheel(0, -400)
    opened.until(f"parseInt(document.getElementById('zoom').textContent) > {whole + 5}")
    page.focus("#stage")
    page.keyboard.press("0")
    assert zoom() == whole
    page.keyboard.press("Escape")
    for choice in ("picture 1", "largest", "share 0"):
        page.select_option("#shown", choice)
        pictures.append(seen())
    assert len(set(pictures)) == len(pictures)


def test_the_model_is_drawn_and_turns(opened: Opened) -> None:
    page = opened.page
    page.locator("iframe").scroll_into_view_if_needed()
    frame = page.frame_locator("iframe")
    frame.locator("html[data-ready=true]").wait_for(state="attached")
    view = frame.locator(".content")
    view.focus()
    shots = [_pixels(view.screenshot(path=opened.folder / "0.png"), opened.folder / "0.png")]
    assert len(np.unique(shots[0].reshape(-1, 3), axis=0)) > 20
    for i, key in enumerate(("ArrowLeft", "ArrowUp", "+", "r"), 1):
        page.keyboard.press(key)
        page.wait_for_timeout(150)
        shots.append(_pixels(view.screenshot(path=opened.folder / f"{i}.png"), opened.folder / f"{i}.png"))
    for before, after in itertools.pairwise(shots[:-1]):
        assert np.mean(np.any(before != after, axis=-1)) > 0.002
    assert np.mean(np.any(shots[0] != shots[-1], axis=-1)) < 0.002  # back to the start


def _pixels(_: bytes, file: pathlib.Path) -> np.ndarray:
    with Image.open(file) as image:
        return np.asarray(image.convert("RGB"))


def test_the_model_opens_alone(made: tuple[pathlib.Path, pathlib.Path], browser: Any) -> None:
    context = browser.new_context(viewport={"width": 500, "height": 400})
    context.set_offline(True)
    page, requests, complaints = context.new_page(), [], []
    page.on("request", lambda request: requests.append(request.url))
    page.on("console", lambda message: message.type == "error" and complaints.append(message.text))
    page.goto((made[1].parent / "view3d.html").as_uri())
    page.locator("html[data-ready=true]").wait_for(state="attached", timeout=PATIENCE)
    assert page.title() == "bundles, in three dimensions"
    assert complaints == []
    assert [url for url in requests if not url.startswith(("file:", "data:", "blob:"))] == []
    context.close()


def test_tables_are_sorted_and_opened(opened: Opened) -> None:
    page = opened.page

    def column(position: int) -> list[str | None]:
        found: list[str | None] = page.eval_on_selector_all(
            f"#class-table tbody tr td:nth-child({position})", "cells => cells.map(cell => cell.dataset.key ?? null)"
        )
        return found

    samples = next(i for i, name in enumerate(page.locator("#class-table thead button").all_inner_texts(), 1) if name == "samples")
    assert len(column(samples)) > 3
    head = page.locator(f"#class-table thead th:nth-child({samples})")
    head.locator("button").focus()
    page.keyboard.press("Enter")
    assert head.get_attribute("aria-sort") == "descending"
    numbers = [float(text) for text in column(samples) if text is not None]
    assert numbers == sorted(numbers, reverse=True)
    assert numbers != numbers[::-1]
    page.keyboard.press("Enter")
    assert head.get_attribute("aria-sort") == "ascending"
    assert [float(text) for text in column(samples) if text is not None] == sorted(numbers)
    # Rows that are folded away come with a button
    table = page.locator("#diagnostic-convergence")
    assert table.locator("tbody tr:visible").count() == 12
    page.locator("[aria-controls=diagnostic-convergence]").click()
    assert table.locator("tbody tr:visible").count() == 16


def test_names_of_a_scene_are_not_obeyed(seen: Opened) -> None:
    assert seen.page.title() == "small – Pathspace report"
    assert "<script>document.title" in seen.page.inner_text("#rankings")  # told, as text


@pytest.mark.parametrize("width", [400, 1280])
def test_nothing_is_wider_than_the_page(seen: Opened, width: int) -> None:
    seen.page.set_viewport_size({"width": width, "height": 800})
    assert seen.page.evaluate("document.documentElement.scrollWidth") <= width
    assert seen.page.locator("#stage").bounding_box()["width"] > 0.5 * min(width, 900)


def test_everything_is_on_paper(seen: Opened) -> None:
    page = seen.page
    paper = page.pdf(format="A4")
    assert paper.startswith(b"%PDF")
    assert len(re.findall(rb"/Type\s*/Page\b", paper)) > 2
    page.emulate_media(media="print")
    assert not page.locator("#inspector").is_visible()
    assert not page.locator(".show-rest").first.is_visible()
    assert page.locator("#image .still img").is_visible()
    assert page.locator(".still-model").is_visible()
    assert page.locator("#diagnostic-convergence tbody tr:visible").count() == 16


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_words_stand_out_from_the_paper(seen: Opened, scheme: str) -> None:
    """Contrast of text against what is behind it: 4.5 or more (WCAG 2.2, 1.4.3)."""
    seen.page.emulate_media(color_scheme=scheme)
    worst = seen.page.evaluate(
        """() => {
        const rgba = (text) => (text.match(/[\\d.]+/g) || []).map(Number);
        const light = (c) => c.slice(0, 3).map((v) => v / 255).map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4))
          .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
        const behind = (node) => {
          for (let at = node; at; at = at.parentElement) {
            const color = rgba(getComputedStyle(at).backgroundColor);
            if (color.length === 3 || color[3] === 1) return color;
          }
          return [255, 255, 255];
        };
        let worst = [99, ''];
        document.querySelectorAll('body *').forEach((node) => {
          if (![...node.childNodes].some((one) => one.nodeType === 3 && one.textContent.trim()) || !node.getClientRects().length) return;
          const [a, b] = [light(rgba(getComputedStyle(node).color)), light(behind(node))];
          const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
          if (contrast < worst[0]) worst = [contrast, node.outerHTML.slice(0, 120)];
        });
        return worst;
        }"""
    )
    assert worst[0] >= 4.5, worst
