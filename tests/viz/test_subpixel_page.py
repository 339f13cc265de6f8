"""The page of subpixel filters as files, and its section in a run's report: all links resolve, names are not obeyed, same bytes."""

import dataclasses
import functools
import html.parser
import json
import pathlib
import re
import shutil

import numpy as np
import pyarrow as pa
import pytest
from PIL import Image

from queries.errors import QueryError, RunError
from queries.subpixel.analysis import Analysis, Display
from queries.subpixel.description import SubpixelDescription
from queries.subpixel.preference import layouts_ranked, methods_ranked
from queries.subpixel.reasons import Reason
from renderer.filters.subpixel.derive import derive
from renderer.filters.subpixel.layout import Layout
from renderer.filters.subpixel.methods import METHODS
from renderer.filters.subpixel.sensitivity import box
from renderer.filters.subpixel.windowed_sinc import fit
from viz.report.pages import environment
from viz.report.picture import Picture
from viz.report.subpixel import subpixel_section
from viz.subpixel.figure import Figure
from viz.subpixel.findings import best, losses, result, summary
from viz.subpixel.page import write_page
from viz.subpixel.pattern import pattern_drawing, pattern_in_words
from viz.subpixel.sections import condition_table, matrices, times, warnings

EVIL = "<script>document.title='obeyed'</script>"
IMAGES = ("text", "hair", "foliage", "wire_frame", "zone_plate", EVIL)
MEAN = {"pixel_box": 4.0, "pixel_mitchell": 3.5, "none": 5.0, "box": 3.0, "mitchell": 2.5, "optimal": 2.0, "kernels": 1.5}
CUSTOM = {"vertical": {"pattern": ["R", "G", "B"], "cells": [1, 3]}}


class Page(html.parser.HTMLParser):
    """What a page links and says: ``links``, ``ids``, ``images`` (attributes), ``headings`` (levels), ``tags``, ``scopes`` of heads of tables."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.ids: list[str] = []
        self.labels: list[str] = []
        self.images: list[dict[str, str | None]] = []
        self.headings: list[int] = []
        self.tags: list[str] = []
        self.scopes: list[str | None] = []
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.tags.append(tag)
        self.links += [value for name in ("href", "src") if (value := given.get(name))]
        self.ids += [value for name, value in attrs if name == "id" and value]
        self.labels += [value for name, value in attrs if name == "aria-labelledby" and value]
        if tag == "img":
            self.images.append(given)
        if tag == "th":
            self.scopes.append(given.get("scope"))
        if re.fullmatch("h[1-6]", tag):
            self.headings.append(int(tag[1]))

    def handle_data(self, data: str) -> None:
        self.text += data


# --- an analysis ---------------------------------------------------------------------------------------------------


def score_table(layouts: list[str], change: dict[tuple[str, str, str], float] | None = None) -> pa.Table:
    """Scores that rank methods as ``MEAN`` does, on every image alike but for what is changed."""
    rows = []
    for layout in layouts:
        for i, image in enumerate(IMAGES):
            for method in METHODS:
                score = (change or {}).get((layout, image, method), MEAN[method] * (1 + 0.1 * i) * (1 + 0.2 * layouts.index(layout)))
                rest = {"scielab_95": 3 * score, "lightness": score / 2, "chroma": score / 3, "weighted_error": score / 50}
                rest |= {"clipped": 0.05, "scielab_unclipped": 0.9 * score, "seconds": 0.001 if i else None}
                rows.append({"layout": layout, "image": image, "method": method, "scielab": score, **rest})
    return pa.Table.from_pylist(rows)


@functools.cache
def analysis(evaluated: bool = True) -> Analysis:
    """Three displays of 12 x 8 pixels, one of them the user's own; a simpler method wins on one image of the first."""
    described = SubpixelDescription.model_validate({"layouts": ["rgb_stripe", "rgbg", "vertical"], "custom": CUSTOM})
    displays = []
    for layout in described.displays().values():
        rows, columns = layout.pattern.shape
        kernels = derive(layout, size=(1 if rows == 1 else 4 * rows, 8 * columns))
        lattice = np.linspace(0, 1.1, 8 * layout.cells[1] * 12 * layout.cells[0], dtype=np.float32).reshape(8 * layout.cells[1], -1)
        displays.append(Display(layout, kernels, fit(kernels), lattice, lattice, 0.091))
    plain = Analysis(EVIL, "image", described, tuple(displays), (12, 8), seconds={"derivation": 0.03})
    if not evaluated:
        return plain
    names = [display.layout.name for display in displays]
    scores = score_table(names, {("rgb_stripe", "hair", "box"): 1.0})
    methods = {name: methods_ranked(scores, name) for name in names}
    lost = Reason("rgb_stripe", "hair", f"{EVIL} wins.")
    return dataclasses.replace(plain, scores=scores, methods=methods, layouts=layouts_ranked(scores), reasons=(lost,))


def drawn(folder: pathlib.Path, name: str, size: tuple[int, int] = (36, 24)) -> pathlib.Path:
    folder.mkdir(parents=True, exist_ok=True)
    Image.new("RGB", size, (10, 200, 30)).save(folder / name)
    return folder / name


def figures(folder: pathlib.Path) -> list[Figure]:
    kernels = Figure(
        "kernels-rgb", "Kernels & more", drawn(folder, "k.png"), "nine curves <1>", "All nine.", "Fig. 4.3 shows <nine>.", "agrees", "Nine."
    )
    return [kernels, Figure("cost", "Cost", drawn(folder, "c.png"), "points and their names", "Cost.", "", "not comparable", "4 ms.")]


def pictures(folder: pathlib.Path) -> list[Picture]:
    exact, other = drawn(folder, "a.png"), drawn(folder, "b.png", (50, 9))
    return [Picture("A <view>", "what & where", "stripes of green", exact, {"clipped": 0.05}), Picture("A <view>", "again", "something else", other)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A folder with a page: figures lie in it, pictures come from elsewhere."""
    made = tmp_path_factory.mktemp("made") / "subpixel"
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    write_page(made, analysis(), figures(made / "figures"), pictures(elsewhere), "pathspace subpixel 'a b' --layout <x>")
    return made


@pytest.fixture(scope="module")
def page(folder: pathlib.Path) -> Page:
    return Page((folder / "index.html").read_text("utf-8"))


# --- the page ------------------------------------------------------------------------------------------------------


def test_everything_that_is_linked_lies_in_the_folder(folder: pathlib.Path, page: Page) -> None:
    assert len(page.ids) == len(set(page.ids))
    assert set(page.labels) <= set(page.ids)
    linked = set()
    for link in page.links:
        if link.startswith("#"):
            assert link[1:] in page.ids
        elif link != "data:,":
            assert not re.match(r"[a-z]+:|/|\.\.", link), f"{link} leaves the folder"
            assert (folder / link).is_file(), link
            linked.add(link)
    known = json.loads((folder / "page.json").read_text("utf-8"))
    assert set(known["files"]) == linked | {"index.html"}
    there = {file.relative_to(folder).as_posix() for file in folder.rglob("*") if file.is_file()}
    assert there == set(known["files"]) | {"page.json"}
    assert {"figures/k.png", "figures/c.png", "pictures/view-a-view.png", "pictures/view-a-view-2.png"} <= linked
    for file in folder.iterdir():
        if file.suffix in (".html", ".js", ".css", ".json"):
            text = file.read_text("utf-8")
            assert not re.search(r"https?://|url\(|@import", text), file.name
            assert str(folder.parent) not in text


def test_names_are_told_and_not_obeyed(folder: pathlib.Path, page: Page) -> None:
    text = (folder / "index.html").read_text("utf-8")
    assert EVIL not in text
    assert "default-src 'self'" in text
    assert 'data-x="108" data-y="72"' in text  # close views begin in the middle of 12 x 8 pixels, 18 of the screen's for each
    assert page.tags.count("script") == 3
    for told in (EVIL, "A <view>", "Fig. 4.3 shows <nine>.", "--layout <x>", "what & where"):
        assert told in page.text


def test_the_page_can_be_read_without_seeing_it(page: Page) -> None:
    assert page.headings[:2] == [1, 2]
    assert page.headings.count(1) == 1
    assert all(after <= before + 1 for before, after in zip(page.headings, page.headings[1:]))
    assert page.tags.count("table") == page.tags.count("caption") >= 11
    assert set(page.scopes) == {"col", "row"}
    told = [image.get("alt") for image in page.images]
    assert told.count("") == 1  # the first picture seen closely, which is described where it is whole
    assert {"nine curves <1>", "points and their names", "stripes of green", "something else"} <= set(told)
    assert {"main", "nav", "header", "footer"} <= set(page.tags)


def test_the_page_tells_all_parts_in_order(page: Page) -> None:
    parts = [f"{name}-heading" for name in ("pictures", "ranking", "scores", "reasons", "kernels", "figures", "settings", "again")]
    assert [name for name in page.ids if name in parts] == parts
    for method in ("Box per pixel", "Optimal, all kernels"):
        assert method in page.text
    assert "1.88 (1." in page.text  # the mean of 1.5 … 2.25, with an interval
    assert "46.62" in page.text  # Table 4.1
    assert "RGB stripe, Hair:" in page.text  # a reason, by titles
    assert "Viewer of all: 100 DPI seen from 46 cm" in page.text
    assert f"{analysis().description.viewing.degrees_per_pixel:.4g}°" in page.text
    assert "Nothing." in page.text  # what the thesis states of cost
    assert "1 agree, 0 differ, 1 not comparable." in page.text
    score_rows = len(IMAGES) * len(METHODS) * 3
    assert f"Show all {score_rows} rows" in page.text


def test_the_same_analysis_gives_the_same_bytes(folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    def files(root: pathlib.Path) -> dict[str, bytes]:
        return {file.relative_to(root).as_posix(): file.read_bytes() for file in root.rglob("*") if file.is_file()}

    again = tmp_path / "again"
    for _ in range(2):  # over an older page too
        write_page(again, analysis(), figures(again / "figures"), pictures(tmp_path), "pathspace subpixel 'a b' --layout <x>")
        assert files(again) == files(folder)


def test_other_files_of_the_folder_stay(tmp_path: pathlib.Path) -> None:
    folder = tmp_path / "subpixel"
    kept = drawn(folder / "pictures", "view-new.png")
    (folder / "scores.arrow").write_text("mine")
    new = Picture("new", "", "the new one", drawn(tmp_path / "elsewhere", "new.png", (1, 1)))
    write_page(folder, analysis(False), [], [new, Picture("old", "", "the old one", kept)])
    assert (folder / "scores.arrow").read_text() == "mine"
    for name, size in (("view-new.png", (36, 24)), ("view-new-2.png", (1, 1))):  # the other took another name
        with Image.open(folder / "pictures" / name) as image:
            assert image.size == size


def test_methods_that_were_not_compared_have_no_parts(tmp_path: pathlib.Path) -> None:
    text = write_page(tmp_path, analysis(False), [], []).read_text("utf-8")
    page = Page(text)
    assert [name for name in page.ids if name.endswith("-heading")] == ["kernels-heading", "settings-heading", "again-heading"]
    assert "were not compared" in page.text
    assert page.images == []


def test_a_figure_that_is_gone_is_named(tmp_path: pathlib.Path) -> None:
    gone = dataclasses.replace(figures(tmp_path / "figures")[0], file=tmp_path / "gone.png")
    with pytest.raises(QueryError, match=r"gone\.png` cannot be read.*draw it again"):
        write_page(tmp_path / "page", analysis(False), [gone], [])
    assert not (tmp_path / "page" / "index.html").exists()


# --- what it says --------------------------------------------------------------------------------------------------


def test_findings_name_the_best_and_the_losses() -> None:
    found = analysis()
    assert best(found) == dict.fromkeys(("rgb_stripe", "rgbg", "vertical"), "kernels")
    assert [(loss.layout, loss.image, loss.method, loss.scielab) for loss in losses(found)] == [("rgb_stripe", "hair", "box", 1.0)]
    first, second, _ = result(found)
    assert first.startswith(
        "Optimal, all kernels comes closest to the reference on RGB stripe: mean S-CIELAB difference 1.88 (95\u00a0% interval 1.6"
    )
    assert "A simpler method beats it on 1 of 6 images: Hair (box per subpixel: 1.00 against 2.20)." in first
    assert "The analytic optimal filter is second, with 3.00 (95\u00a0% interval 2.5" in second
    assert "the first is better beyond chance" in second
    assert "No simpler method beats the optimal filter" in second
    assert summary(found) == "\n".join(result(found))
    assert best(analysis(False)) == {}


def test_times_of_one_display_are_one_stage() -> None:
    taken = {"derivation": 0.5, "rgbg: box": 1.0, "rgbg: optimal": 2.0, "comparison": 4.0}
    expected = [("derivation", 0.5), ("filtering for PenTile RGBG", 3.0), ("comparison", 4.0)]
    assert times(dataclasses.replace(analysis(False), seconds=taken)) == expected


def test_marks_of_scores() -> None:
    scores = analysis().scores
    assert scores is not None
    stripe = matrices(scores)[0]
    marks = {image: dict(zip(stripe.methods, row)) for image, row in stripe.rows}
    assert [name for name, mark in marks["Hair"].items() if mark.best] == ["Box per subpixel"]
    assert [name for name, mark in marks["Hair"].items() if mark.lost] == ["Optimal, analytic"]
    assert [name for name, mark in marks["Text"].items() if mark.best] == ["Optimal, all kernels"]
    assert not any(mark.lost for mark in marks["Text"].values())
    assert marks["Wire frame"]["Box per pixel"].text == "5.20"


def test_singular_systems_are_told(tmp_path: pathlib.Path) -> None:
    found = analysis(False)
    assert not any("singular" in text for text in warnings(found))
    assert condition_table(found).rows[0][3].text == "3.95"  # of 8 pixels at 31.61 a degree
    display = found.displays[0]
    narrow = derive(display.layout, sensitivity=box((4.0, 1.0, 1.0)), size=(1, 24))
    assert narrow.singular
    changed = dataclasses.replace(found, displays=(dataclasses.replace(display, kernels=narrow),))
    page = Page(write_page(tmp_path, changed, [], []).read_text("utf-8"))
    assert all(text.startswith("RGB stripe") for text in warnings(changed))
    assert f"the system is singular for {narrow.deficient} of {narrow.residues} residues" in page.text
    assert f"{narrow.deficient} of {narrow.residues}" in [cell.text for cell in condition_table(changed).rows[0]]


def rects(layout: Layout) -> list[tuple[float, ...]]:
    """x, y, width and height of the subpixels that are drawn."""
    found = re.findall(r'<rect x="([^"]+)" y="([^"]+)" width="([^"]+)" height="([^"]+)" rx', pattern_drawing(layout, "x"))
    return [tuple(map(float, one)) for one in found]


def test_subpixels_are_drawn_where_they_are() -> None:
    layouts = SubpixelDescription.model_validate({"layouts": ["rgb_stripe", "rgbg", "rgbw"]}).displays()
    stripe = rects(layouts["rgb_stripe"])  # two pixels by two, 72 units each
    assert len(stripe) == 12
    assert stripe[0] == pytest.approx((1, 1, 22, 70))
    assert stripe[4] == pytest.approx((97, 1, 22, 70))
    # The red one of RGBG is two thirds of a pixel wide and begins where the pixel does; the green one is half as wide
    assert rects(layouts["rgbg"])[:2] == [pytest.approx((1, 1, 46, 70)), pytest.approx((49, 1, 22, 70))]
    assert len(rects(layouts["rgbw"])) == 16
    assert pattern_in_words(layouts["rgbw"]) == "a period of 1 pixel: red and green; below: blue and white"
    assert pattern_in_words(layouts["rgbg"]) == "a period of 2 pixels: red, green, blue and green"
    # All of a display is lit: what the rectangles cover, without the gaps of two units between them
    for layout in layouts.values():
        assert sum((width + 2) * (height + 2) for _, _, width, height in rects(layout)) == pytest.approx(144 * 144, rel=1e-6)


# --- the report of a run -------------------------------------------------------------------------------------------


class FolderOfRun:
    """As much of a run as the section asks for."""

    def __init__(self, path: pathlib.Path) -> None:
        self.path = path


def section(run: pathlib.Path, work: pathlib.Path) -> object:
    return subpixel_section(FolderOfRun(run), work)  # type: ignore[arg-type]


@pytest.fixture
def run(folder: pathlib.Path, tmp_path: pathlib.Path) -> pathlib.Path:
    """A run folder with a finished analysis."""
    path = tmp_path / "run"
    shutil.copytree(folder, path / "subpixel")
    ranked = [table.add_column(0, "layout", pa.array([name] * table.num_rows)) for name, table in analysis().methods.items()]
    with pa.OSFile(str(path / "subpixel" / "methods.arrow"), "wb") as file, pa.ipc.new_stream(file, ranked[0].schema) as writer:
        writer.write_table(pa.concat_tables(ranked))
    known = {"layouts": list(best(analysis())), "best": best(analysis()), "page": "index.html", "summary": summary(analysis())}
    (path / "subpixel" / "subpixel.json").write_text(json.dumps(known))
    return path


def test_the_section_has_the_ranking_and_the_whole_page(run: pathlib.Path, folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    work = tmp_path / "report"
    found = subpixel_section(FolderOfRun(run), work)  # type: ignore[arg-type]
    assert found is not None
    assert found.summary == summary(analysis())
    assert [table.caption for table in found.tables] == [
        f"Methods on {name}, judged on 6 images, the best first" for name in ("RGB stripe", "PenTile RGBG", "vertical")
    ]
    assert found.tables[0].rows[0][1].text == "Optimal, all kernels"
    assert [column.heading for column in found.tables[0].columns][2] == "S-CIELAB (95 % interval)"
    copied = {file.relative_to(work).as_posix() for file in work.rglob("*") if file.is_file()}
    assert copied == {f"subpixel/{name}" for name in json.loads((folder / "page.json").read_text())["files"]}  # tables stay with the run
    assert (work / found.page).read_bytes() == (folder / "index.html").read_bytes()
    anchors = Page((work / found.page).read_text("utf-8")).ids
    assert [anchor in anchors for anchor, _ in found.figures] == [True, True]
    assert [(shown.name, shown.width) for _, shown in found.figures] == [("Kernels & more", 36), ("Cost", 36)]


def test_without_a_finished_analysis_there_is_no_section(run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    assert section(tmp_path, tmp_path / "work") is None
    (run / "subpixel" / "subpixel.json").unlink()
    assert section(run, tmp_path / "work") is None
    assert not (tmp_path / "work").exists()


@pytest.mark.parametrize(("file", "content"), [("subpixel.json", "{"), ("page.json", "[]"), ("methods.arrow", "ARROW"), ("figures/k.png", None)])
def test_damaged_analyses_are_named(run: pathlib.Path, tmp_path: pathlib.Path, file: str, content: str | None) -> None:
    if content is None:
        (run / "subpixel" / file).unlink()
    else:
        (run / "subpixel" / file).write_text(content)
    with pytest.raises(RunError, match=f"{file}` cannot be read"):
        section(run, tmp_path / "work")


def test_a_page_takes_no_files_from_elsewhere(run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    (run / "secret").write_text("mine")
    contents = json.loads((run / "subpixel" / "page.json").read_text())
    (run / "subpixel" / "page.json").write_text(json.dumps(contents | {"files": ["../secret"]}))
    with pytest.raises(RunError, match="lies elsewhere"):
        section(run, tmp_path / "work")


def test_the_report_shows_the_section_where_there_is_one(run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    """The template alone: reports of runs are written elsewhere in the tests."""
    macros = environment().from_string("{% import 'macros.html.j2' as show with context %}" + section_of_template())
    found = section(run, tmp_path / "work")
    page = Page(macros.render(subpixel=found))
    assert page.links[0] == "subpixel/index.html"
    assert page.links.count("subpixel/index.html#figure-cost") == 1
    assert len(page.images) == 2
    assert "comes closest to the reference" in page.text
    assert EVIL in page.text or EVIL not in summary(analysis())
    assert macros.render(subpixel=None).strip() == ""


def section_of_template() -> str:
    """The part of the report's template that is the section."""
    text = (pathlib.Path(str(environment().loader.searchpath[0])) / "report.html.j2").read_text("utf-8")
    return text[text.index('{% if subpixel %}\n\n<section id="subpixel"') : text.index('<section id="diagnostics"')]
