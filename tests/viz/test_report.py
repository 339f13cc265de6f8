"""The report as files: everything it links is there, nothing in a scene is obeyed, and the same run gives the same bytes."""

import base64
import html.parser
import json
import pathlib
import re
import shutil
import zipfile
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
import pyvista
from PIL import Image
from report_run import EVIL, report_run

from queries import open_run
from queries.diagnostics import DIAGNOSTICS
from queries.diagnostics.answers import REAL, TEXT, Figure, answer
from queries.errors import QueryError
from queries.images import images
from queries.pixel_classes import NO_CLASS, SLOTS, WHOLE, pixel_classes
from viz.report import Eye, Model, Picture, Shape, write_report
from viz.report.model import scene_archive
from viz.report.numbers import number, percent, with_error
from viz.report.pages import slug
from viz.report.pixels import cell_means, class_colors


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    return report_run(tmp_path_factory.mktemp("reported"))


class Page(html.parser.HTMLParser):
    """What a page links and says: ``links``, ``ids``, ``images`` (attributes), ``headings`` (levels), ``tags``."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.ids: list[str] = []
        self.images: list[dict[str, str | None]] = []
        self.headings: list[int] = []
        self.tags: list[str] = []
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.tags.append(tag)
        self.links += [value for name in ("href", "src") if (value := given.get(name))]
        self.ids += [value for name, value in attrs if name == "id" and value]
        if tag in ("img", "iframe"):
            self.images.append(given)
        if re.fullmatch("h[1-6]", tag):
            self.headings.append(int(tag[1]))

    def handle_data(self, data: str) -> None:
        self.text += data


def picture(folder: pathlib.Path, name: str = "A <view>") -> Picture:
    file = folder / "drawn.png"
    Image.new("RGB", (8, 6), (10, 200, 30)).save(file)
    (folder / "drawn.vtp").write_text("mesh")
    return Picture(name, "what & where", "green & nothing else", file, {"paths_drawn": 12, "total_flux": 0.25}, {"vtp": folder / "drawn.vtp"})


def model(folder: pathlib.Path) -> Model:
    lines = pyvista.PolyData(np.array([[0, 0, 0], [1, 1, 0], [0, 1, 1]], np.float32), lines=np.array([3, 0, 1, 2]))
    lines.cell_data["rgb"] = np.array([[255, 0, 0]], np.uint8)
    box = pyvista.Box((-1, 1, -1, 1, -1, 1), quads=True)
    shapes = [Shape(box, opacity=0.2), Shape(lines, colors="rgb")]
    return Model("</script><b>bundles", "Turn me.", "Lines in a box", shapes, Eye((0, 0, 5), (0, 0, 0)), picture(folder).file)


def write(run_folder: pathlib.Path, folder: pathlib.Path, **further: Any) -> pathlib.Path:
    with open_run(run_folder) as run:
        return write_report(run, folder, **further)


@pytest.fixture(scope="module")
def report(run_folder: pathlib.Path, tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A report with everything in it; its folder."""
    work = tmp_path_factory.mktemp("pictures")
    drawn: list[tuple[str, str]] = []

    def draw(name: str, expression: str) -> Picture | None:
        drawn.append((name, expression))
        return None if len(drawn) == 2 else picture(work, name)

    cut = answer((Figure("energy", REAL, "energy"), Figure("verdict", TEXT, "why")), {"energy": [0.5], "verdict": ["<i>x"]})
    more = {"pictures": [picture(work), picture(work)], "models": [model(work)], "answers": {"cut": ("what depth cuts", cut)}, "draw": draw, "top": 3}
    page = write(run_folder, tmp_path_factory.mktemp("out") / "report", command="pathspace run 'a b'", **more)
    assert [name for name, _ in drawn] == [f"block-0{i}" for i in (1, 2, 3)]
    assert all("X@block" in expression for _, expression in drawn)
    return page.parent


@pytest.fixture(scope="module")
def page(report: pathlib.Path) -> Page:
    return Page((report / "index.html").read_text("utf-8"))


def test_links_lead_to_files_of_the_report(report: pathlib.Path, page: Page) -> None:
    assert len(page.links) > 25
    assert len(page.ids) == len(set(page.ids))
    for link in page.links:
        if link.startswith("#"):
            assert link[1:] in page.ids
        elif link != "data:,":
            assert not re.match(r"[a-z]+:|/|\.\.", link), f"{link} leaves the folder"
            assert (report / link).is_file(), link
    linked = {report / link for link in page.links if not link.startswith(("#", "data:"))}
    alone = {file for file in report.rglob("*") if file.is_file()} - linked
    assert {file.name for file in alone} == {"index.html", "report.json"}  # nothing lies there that nobody can reach
    assert not list(report.parent.glob(".*"))


def test_nothing_points_at_a_network(report: pathlib.Path) -> None:
    for file in report.rglob("*"):
        if file.suffix in (".html", ".js", ".css"):
            text = file.read_text("utf-8")
            # What remains in vtk.js are comments: on copyright, and where to read more
            assert not re.findall(r"https?://", text) or file.name == "view3d.html"
            assert "favicon-" not in text


def test_names_of_a_scene_are_not_obeyed(report: pathlib.Path, page: Page) -> None:
    text = (report / "index.html").read_text("utf-8")
    assert EVIL not in text
    assert EVIL in page.text  # it is told, as text
    assert page.tags.count("script") == 4
    assert "<view>" in page.text
    assert "<i>x" in page.text
    assert "<b>" not in (report / "view3d.html").read_text("utf-8").split("</title>")[0]
    assert (report / "data" / "pixels.js").read_text("ascii").isascii()


def test_every_picture_says_what_it_shows(page: Page) -> None:
    assert len(page.images) > 8
    for image in page.images:
        assert len(str(image.get("alt" if "alt" in image else "title") or "")) > 8
    assert page.headings[0] == 1
    assert page.headings.count(1) == 1
    assert all(after <= before + 1 for before, after in zip(page.headings, page.headings[1:]))
    assert {"main", "nav", "header", "footer", "caption"} <= set(page.tags)


def test_the_page_tells_what_was_asked(run_folder: pathlib.Path, report: pathlib.Path, page: Page) -> None:
    with open_run(run_folder) as run:
        classes = DIAGNOSTICS["classes"][0](run).to_pylist()
        manifest = run.manifest
    for row in classes[:5]:
        assert row["expression"] in page.text
        assert with_error(row["energy"], row["standard_error"]) in page.text
    sums = manifest["fingerprint"]["scene"], manifest["images"]["beauty"]["exr"]["xxh3"]
    for fact in (*manifest["versions"].values(), *sums, "pathspace run 'a b'"):
        assert fact in page.text
    for name in DIAGNOSTICS:
        assert name.capitalize() in page.text or name == "classes"
    assert "C D .+ L" in page.text
    assert "sampler: sobol" in (report / "job.yaml").read_text("utf-8")
    assert "Rank 1" in page.text
    assert "Rank 2" not in page.text  # which could not be drawn
    assert "Rank 3" in page.text


def test_pixels_are_those_of_the_run(run_folder: pathlib.Path, report: pathlib.Path) -> None:
    data = json.loads((report / "data" / "pixels.js").read_text().removeprefix("window.pathspacePixels = ").rstrip().removesuffix(";"))
    with open_run(run_folder) as run:
        found, whole = pixel_classes(run), images(run, {"all": "C .* [LOB]"})["all"]
    radiance = np.frombuffer(base64.b64decode(data["radiance"]), "<f4").reshape(16, 24, 3)
    np.testing.assert_allclose(radiance, whole, rtol=1e-5, atol=1e-7)
    assert base64.b64decode(data["classes"]) == found.classes.tobytes()
    assert base64.b64decode(data["parts"]) == found.parts.astype("<u2").tobytes()
    assert (data["slots"], data["whole"], data["block"]) == (SLOTS, WHOLE, 1)
    assert [name["expression"] for name in data["names"]] == [name.expression for name in found.named]
    assert (found.classes != NO_CLASS).any()


def test_the_same_run_gives_the_same_bytes(run_folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    first, second = (write(run_folder, tmp_path / name, models=[model(tmp_path)]).parent for name in ("a", "b"))
    files = {file.relative_to(first): file.read_bytes() for file in first.rglob("*") if file.is_file()}
    assert len(files) > 10
    assert files == {file.relative_to(second): file.read_bytes() for file in second.rglob("*") if file.is_file()}


def test_an_older_report_is_replaced_and_nothing_else(run_folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("years of work")
    with pytest.raises(QueryError, match="name another folder"):
        write(run_folder, tmp_path / "mine")
    assert (tmp_path / "mine" / "thesis.tex").read_text() == "years of work"
    report = write(run_folder, tmp_path / "report").parent
    (report / "old.png").write_text("left over")
    assert write(run_folder, tmp_path / "report").is_file()
    assert not (report / "old.png").exists()


def test_a_failure_leaves_the_older_report(run_folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    index = write(run_folder, tmp_path / "report")
    before = index.read_bytes()
    with pytest.raises(QueryError, match="draw it again"):
        write(run_folder, tmp_path / "report", pictures=[Picture("gone", "", "", tmp_path / "gone.png")])
    assert index.read_bytes() == before
    assert sorted(file.name for file in tmp_path.iterdir()) == ["report"]


def test_a_run_without_paths_has_a_report(tmp_path: pathlib.Path) -> None:
    folder = report_run(tmp_path, record={"keep": "none"}, aovs={}, rank={}, regions={})
    page = Page(write(folder, tmp_path / "report").read_text("utf-8"))
    assert page.text.count("No answer: ") == len(DIAGNOSTICS)
    assert "recorded no paths" in page.text
    data = (tmp_path / "report" / "data" / "pixels.js").read_text()
    assert '"classes"' not in data
    assert '"radiance"' in data


def test_views_of_a_run_are_shown(run_folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    views = run_folder / "views"
    views.mkdir()
    try:
        Image.new("RGB", (8, 6)).save(views / "bundles.png")
        Image.new("RGB", (8, 6)).save(views / "flight.gif")
        Image.new("RGB", (8, 6)).save(views / "flight.png")
        with open_run(run_folder) as run:
            run.manifest["views"] = {
                "bundles": {
                    "caption": "bundled",
                    "alt": "curves from lamp to floor",
                    "figures": {"paths_drawn": 1200},
                    "files": {"png": "views/bundles.png"},
                },
                "flight": {"caption": "moving", "alt": "light on its way", "files": {"png": {"rows": 0, "bytes": 3}, "gif": "views/flight.gif"}},
                "gone": {"caption": "", "alt": "", "figures": {}, "files": {"png": "views/gone.png"}},
            }
            page = Page(write_report(run, tmp_path / "report").read_text("utf-8"))
    finally:
        for file in views.iterdir():
            file.unlink()
        views.rmdir()
    alts = [image.get("alt") for image in page.images]
    assert "curves from lamp to floor" in alts
    assert "pictures/view-flight.gif" in page.links
    assert "pictures/view-flight-png.png" in page.links
    assert "1,200" in page.text
    assert "pictures/view-gone.png" not in page.links


def test_subpixel_filters_are_told_where_there_are_any(run_folder: pathlib.Path, page: Page, tmp_path: pathlib.Path) -> None:
    assert "subpixel-heading" not in page.ids
    analysis = run_folder / "subpixel"
    analysis.mkdir()
    try:
        (analysis / "index.html").write_text("<!doctype html><title>all of it</title>")
        (analysis / "page.json").write_text('{"files": ["index.html"], "figures": []}')
        (analysis / "subpixel.json").write_text('{"page": "index.html", "summary": "On <x>, box comes closest.\\nOn y, none does."}')
        shown = Page(write(run_folder, tmp_path / "report").read_text("utf-8"))
    finally:
        shutil.rmtree(analysis)
    assert "subpixel-heading" in shown.ids
    assert "#subpixel" in shown.links
    assert "On <x>, box comes closest." in shown.text
    assert "subpixel/index.html" in shown.links
    assert (tmp_path / "report" / "subpixel" / "index.html").read_text().endswith("<title>all of it</title>")


# --- parts ---------------------------------------------------------------------------------------------------------


def test_a_model_holds_its_arrays(tmp_path: pathlib.Path) -> None:
    given = model(tmp_path)
    (tmp_path / "scene.zip").write_bytes(scene_archive(given))
    with zipfile.ZipFile(tmp_path / "scene.zip") as archive:
        scene = json.loads(archive.read("index.json"))
    camera, *actors = scene["scene"]["dependencies"][0]["dependencies"]
    assert camera["properties"]["position"] == [0, 0, 5]
    assert [actor["type"] for actor in actors] == ["vtkActor", "vtkActor"]
    box, lines = (actor["dependencies"][0]["dependencies"][0]["properties"] for actor in actors)

    def values(known: dict[str, Any], kind: str) -> Any:
        return np.frombuffer(base64.b64decode(scene["hashes"][known["hash"]]["content"]), kind)

    np.testing.assert_array_equal(values(lines["points"], "f4").reshape(-1, 3), given.shapes[1].mesh.points)
    assert values(lines["lines"], "u4").tolist() == [3, 0, 1, 2]
    assert values(lines["fields"][0], "u1").tolist() == [255, 0, 0]
    assert lines["fields"][0]["location"] == "cellData"
    assert len(values(box["polys"], "u4")) == 12 * 4  # triangles: vtk.js draws no larger polygons rightly


def test_a_model_that_is_too_large_is_refused(run_folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    points = np.random.default_rng(1).random((2_000_000, 3)).astype(np.float32)
    cloud = pyvista.PolyData(points, lines=np.array([2, 0, 1]))
    huge = Model("cloud", "", "a cloud", [Shape(cloud)], Eye((0, 0, 5), (0, 0, 0)))
    with pytest.raises(QueryError, match="draw fewer paths"):
        write(run_folder, tmp_path / "report", models=[huge])


def test_means_of_blocks_that_the_edge_cuts() -> None:
    image = np.arange(5 * 7 * 3, dtype=np.float32).reshape(5, 7, 3)
    means = cell_means(image, 3)
    assert means.shape == (2, 3, 3)
    for row in range(2):
        for column in range(3):
            np.testing.assert_allclose(means[row, column], image[3 * row : 3 * row + 3, 3 * column : 3 * column + 3].mean(axis=(0, 1)), rtol=1e-6)


def test_numbers_for_people() -> None:
    assert [number(x) for x in (None, True, 12, 1234.5, 1e-9, 1e15, -0.5, float("inf"))] == [
        *("–", "yes", "12", "1,234", "1 × 10⁻⁹", "1 × 10¹⁵", "−0.5", "∞")
    ]
    assert with_error(1.23456e-5, 1.2e-7) == "(1.235 ± 0.012) × 10⁻⁵"
    assert with_error(123456.0, 1200.0) == "123,456 ± 1,200"
    assert with_error(2.4677e10, 1.6957e10) == "(2.5 ± 1.7) × 10¹⁰"
    assert with_error(0.5, 2e6) == "(0.0 ± 2.0) × 10⁶"
    assert [percent(x) for x in (None, 0.0, 1.0, 0.999, 0.00312)] == ["–", "0.00 %", "100 %", "99.9 %", "0.312 %"]
    assert slug("../../etc/<x> Y") == "etc-x-y"
    assert len(set(class_colors(60))) == 60


def test_a_damaged_ranking_is_named(run_folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    file = run_folder / "rankings" / "block.arrow"
    whole = file.read_bytes()
    try:
        file.write_bytes(whole[:100])
        with pytest.raises(ValueError, match=r"block\.arrow` cannot be read"):
            write(run_folder, tmp_path / "report")
    finally:
        file.write_bytes(whole)


def test_answers_may_be_reasons(run_folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    answers = {"cut": ("x", "the job is gone"), "more": ("y", pa.table({"a": [1]}))}
    text = Page(write(run_folder, tmp_path / "r", answers=answers).read_text("utf-8")).text
    assert "No answer: the job is gone" in text
    assert "More" in text
