"""A scene from a Mitsuba 3 XML file: defaults, ``$parameters``, includes and aliases are resolved while it is read.

expat is driven directly, since it says at which line each element starts; entities are refused.
"""

import pathlib
import re
import xml.parsers.expat
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from renderer.errors import SceneError
from renderer.scene.description import MAX_DEPTH, Node, Reference, Value, listing, nearest
from renderer.scene.matrices import matrix_of, matrix_of_step
from renderer.scene.paths import Paths
from renderer.scene.transforms import F64

OBJECTS = ("scene", "shape", "bsdf", "emitter", "sensor", "film", "rfilter", "sampler", "integrator", "texture")
VALUES = ("float", "integer", "boolean", "string", "vector", "point", "rgb", "spectrum", "transform", "ref")
DIRECTIVES = ("default", "include", "alias", "path")
UNSUPPORTED = ("medium", "phase", "volume", "emitter_volume", "animation")
STEPS = ("translate", "scale", "rotate", "lookat", "matrix")
TAGS = (*OBJECTS, *VALUES, *DIRECTIVES, *STEPS)
PARAMETER = re.compile(r"\$(\w+)")


@dataclass
class Element:
    """One XML element with its place."""

    tag: str
    attributes: dict[str, str]
    place: str
    children: list["Element"] = field(default_factory=list)


def parse_elements(data: bytes, name: str) -> Element:
    """The elements of an XML text; ``name`` is what places call the file."""
    parser = xml.parsers.expat.ParserCreate()
    top = Element("", {}, name)
    stack = [top]

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = Element(tag, attributes, f"{name}:{parser.CurrentLineNumber}")
        if len(stack) > MAX_DEPTH:
            raise SceneError(f"elements are nested more than {MAX_DEPTH} deep", element.place)
        stack[-1].children.append(element)
        stack.append(element)

    def end(tag: str) -> None:
        stack.pop()

    def text(data: str) -> None:
        if data.strip():
            raise SceneError(f"unexpected text {data.strip()[:40]!r} in <{stack[-1].tag}>", f"{name}:{parser.CurrentLineNumber}")

    def doctype(*arguments: Any) -> None:
        raise SceneError("document types and entities are not supported in a scene", f"{name}:{parser.CurrentLineNumber}")

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler, parser.StartDoctypeDeclHandler = text, doctype
    try:
        parser.Parse(data, True)
    except xml.parsers.expat.ExpatError as error:
        raise SceneError(f"this is not XML: {xml.parsers.expat.ErrorString(error.code)}", f"{name}:{error.lineno}") from None
    return top.children[0]


class XmlReader:
    """The conversion of a file and what it includes into one tree."""

    def __init__(self, parameters: Mapping[str, str], paths: Paths) -> None:
        self.given = dict(parameters)
        self.defaults: dict[str, str] = {}
        self.used: set[str] = set()
        self.paths = paths
        self.counts: dict[str, int] = {}

    def read(self, path: pathlib.Path) -> Element:
        """The root element of a file."""
        try:
            return parse_elements(path.read_bytes(), str(path))
        except OSError as error:
            raise SceneError(f"cannot read the file: {error.strerror}", str(path)) from None

    def scene(self, path: pathlib.Path) -> Node:
        """The tree of a whole file."""
        element = self.read(path)
        if element.tag != "scene":
            raise SceneError(f"expected a <scene>, found <{element.tag}>", element.place)
        check_version(element)
        root = Node("scene", "scene", element.place)
        self.fill(root, element, (path.resolve(),), 0)
        unused = [name for name in self.given if name not in self.used]
        if unused:
            known = f"; the scene has {listing('$' + k for k in self.defaults)}" if self.defaults else "; the scene has none"
            raise SceneError(f"the scene has no parameter {unused[0]!r}{nearest(unused[0], self.defaults) or known}", str(path))
        return root

    # --- attributes ---------------------------------------------------------------------------------------------

    def substitute(self, text: str, place: str) -> str:
        """A text with its ``$parameters`` replaced."""

        def value(match: re.Match[str]) -> str:
            name = match[1]
            self.used.add(name)
            if name in self.given:
                return str(self.given[name])
            if name in self.defaults:
                return self.defaults[name]
            hint = nearest(name, {**self.defaults, **self.given})
            raise SceneError(f"the parameter ${name} has no value{hint}; give it one, or a <default name={name!r} value=…/> before this line", place)

        return PARAMETER.sub(value, text)

    def attributes(self, element: Element, required: tuple[str, ...], optional: tuple[str, ...] = ()) -> dict[str, str]:
        """An element's attributes, parameters replaced; missing and unknown ones are errors."""
        for name in required:
            if name not in element.attributes:
                raise SceneError(f"<{element.tag}> needs the attribute {name!r}", element.place)
        for name in element.attributes:
            if name not in (*required, *optional):
                known = (*required, *optional)
                raise SceneError(f"<{element.tag}> has no attribute {name!r}{nearest(name, known)}; known: {listing(known)}", element.place)
        return {name: self.substitute(text, element.place) for name, text in element.attributes.items()}

    def numbers(self, text: str, element: Element) -> list[float]:
        """Numbers that are separated by spaces or commas."""
        found = []
        for word in re.split(r"[\s,]+", text.strip()):
            try:
                found.append(float(word))
            except ValueError:
                raise SceneError(f"<{element.tag}>: expected numbers, found {word!r}", element.place) from None
        return found

    # --- elements -----------------------------------------------------------------------------------------------

    def fill(self, node: Node, element: Element, files: tuple[pathlib.Path, ...], depth: int) -> None:
        """Add what stands inside an element to its node."""
        for child in element.children:
            if child.tag == "default":
                a = self.attributes(child, ("name", "value"))
                self.defaults.setdefault(a["name"], a["value"])
            elif child.tag == "path":
                self.search(self.attributes(child, ("value",))["value"], files[-1].parent, child.place)
            elif child.tag == "include":
                self.include(node, child, files, depth)
            elif child.tag == "alias":
                self.alias(node, child)
            elif child.tag in OBJECTS[1:] or (child.tag == "spectrum" and "type" in child.attributes):
                inner = self.object(child, files, depth + 1)
                self.put(node, child.attributes.get("name"), Value(inner, child.place), inner.name)
            elif child.tag in VALUES:
                self.put(node, child.attributes.get("name"), self.value(child), child.tag)
            else:
                self.refuse(child, element)

    def put(self, node: Node, name: str | None, value: Value, fallback: str) -> None:
        """Set a property; nameless objects are called by what they are. A name that stands twice is an error."""
        key = self.substitute(name, value.place) if name is not None else fallback
        if name is None:
            while key in node.properties:
                self.counts[fallback] = self.counts.get(fallback, 0) + 1
                key = f"{fallback}_{self.counts[fallback]}"
            if isinstance(value.data, Node) and not value.data.named:
                value.data.name = key
        elif key in node.properties:
            raise SceneError(f"{node.plugin}: the property {key!r} stands twice; first at {node.properties[key].place}", value.place)
        node.properties[key] = value

    def object(self, element: Element, files: tuple[pathlib.Path, ...], depth: int) -> Node:
        """A plugin element as a node."""
        a = self.attributes(element, ("type",), ("id", "name"))
        node = Node(a["type"], a.get("id", a["type"]), element.place, named="id" in a)
        self.fill(node, element, files, depth)
        return node

    def include(self, node: Node, element: Element, files: tuple[pathlib.Path, ...], depth: int) -> None:
        """Read another file's scene in place of the element."""
        path = self.paths.find(self.attributes(element, ("filename",))["filename"], element.place)
        if path in files:
            raise SceneError(f"a cycle of includes: {' -> '.join(p.name for p in (*files, path))}", element.place)
        if len(files) >= MAX_DEPTH:
            raise SceneError(f"files include each other more than {MAX_DEPTH} deep", element.place)
        inner, chain = self.read(path), (*files, path)
        if inner.tag == "scene":
            check_version(inner)
            self.fill(node, inner, chain, depth)
        else:
            self.fill(node, Element("scene", {}, inner.place, [inner]), chain, depth)

    def alias(self, node: Node, element: Element) -> None:
        """Give a node that stands here a second id."""
        a = self.attributes(element, ("id", "as"))
        target = next((child for _, child in node.children() if child.named and child.name == a["id"]), None)
        if target is None:
            raise SceneError(f"<alias>: nothing before it has the id {a['id']!r}", element.place)
        self.put(node, a["as"], Value(Reference(a["id"]), element.place), a["as"])

    def search(self, folder: str, start: pathlib.Path, place: str) -> None:
        """Look up file names in another folder too."""
        found = [base / folder for base in (start, *self.paths.folders) if (base / folder).is_dir()]
        if not found:
            raise SceneError(f"<path>: there is no folder {folder!r}", place)
        self.paths.folders.append(found[0])

    def refuse(self, child: Element, parent: Element) -> None:
        """The error for an element that cannot stand here."""
        known = (*OBJECTS[1:], *VALUES, *DIRECTIVES)
        what = "is not supported" if child.tag in UNSUPPORTED else f"cannot stand in <{parent.tag}>"
        raise SceneError(f"<{child.tag}> {what}{nearest(child.tag, known)}; supported: {listing(known)}", child.place)

    # --- values -------------------------------------------------------------------------------------------------

    def value(self, element: Element) -> Value:
        """A property element."""
        tag, place = element.tag, element.place
        if tag == "transform":
            self.attributes(element, ("name",))
            return Value(self.transform(element), place)
        if element.children:
            raise SceneError(f"<{tag}> holds no elements, but found <{element.children[0].tag}>", element.children[0].place)
        if tag == "ref":
            return Value(Reference(self.attributes(element, ("id",), ("name",))["id"]), place)
        if tag in ("vector", "point"):
            return Value(self.vector(element, 0.0, ("name",)), place)
        text = self.attributes(element, ("name", "value"))["value"].strip()
        if tag == "string":
            return Value(text, place)
        if tag == "boolean":
            if text.lower() not in ("true", "false"):
                raise SceneError(f"<boolean> must be true or false, not {text!r}", place)
            return Value(text.lower() == "true", place)
        if tag in ("rgb", "spectrum"):
            return Value(self.spectrum(element, text), place)
        return Value(self.scalar(element, text), place)

    def scalar(self, element: Element, text: str) -> int | float:
        """A <float> or <integer>."""
        try:
            return int(text) if element.tag == "integer" else float(text)
        except ValueError:
            raise SceneError(f"<{element.tag}> must be a {'whole ' if element.tag == 'integer' else ''}number, not {text!r}", element.place) from None

    def spectrum(self, element: Element, text: str) -> Node:
        """An <rgb> or <spectrum> as the node that it stands for."""
        node = Node(element.tag, element.tag, element.place)
        if element.tag == "rgb" and re.fullmatch(r"#[0-9a-fA-F]{6}", text):
            raise SceneError(f"<rgb>: write linear numbers such as '0.2 0.5 0.1' in place of {text!r}", element.place)
        if ":" in text or pathlib.PurePath(text).suffix == ".spd":
            raise SceneError("<spectrum>: spectra over wavelengths are not supported, since rendering is in RGB; give an <rgb>", element.place)
        found = self.numbers(text, element)
        if len(found) not in ((1, 3) if element.tag == "rgb" else (1,)):
            wanted = "one or three numbers" if element.tag == "rgb" else "one number"
            raise SceneError(f"<{element.tag}> needs {wanted}, found {len(found)}", element.place)
        node.properties["value"] = Value(found if len(found) == 3 else found[0], element.place)
        return node

    def vector(self, element: Element, default: float, names: tuple[str, ...] = ()) -> list[float]:
        """Three numbers, as ``value`` or as x, y, z."""
        a = self.attributes(element, names, ("value", "x", "y", "z"))
        if "value" in a:
            if set(a) & {"x", "y", "z"}:
                raise SceneError(f"<{element.tag}> has either a value or x, y and z", element.place)
            found = self.numbers(a["value"], element)
            if element.tag == "scale" and len(found) == 1:
                found *= 3
        else:
            if element.tag in ("vector", "point") and set(a) - {"name"} != {"x", "y", "z"}:
                raise SceneError(f"<{element.tag}> needs a value, or all of x, y and z", element.place)
            found = [self.numbers(a[axis], element)[0] if axis in a else default for axis in "xyz"]
        if len(found) != 3:
            raise SceneError(f"<{element.tag}> needs three numbers, found {len(found)}", element.place)
        return found

    def transform(self, element: Element) -> F64:
        """The operations inside a <transform>, in their order."""
        m = np.eye(4)
        for step in element.children:
            if step.tag not in STEPS:
                raise SceneError(f"<{step.tag}> cannot stand in <transform>{nearest(step.tag, STEPS)}; supported: {listing(STEPS)}", step.place)
            m = self.step(step) @ m
        return m

    def step(self, element: Element) -> F64:
        """One operation of a transform."""
        tag, place = element.tag, element.place
        if tag == "matrix":
            return matrix_of(self.numbers(self.attributes(element, ("value",))["value"], element), place)
        if tag == "lookat":
            a = self.attributes(element, ("origin", "target"), ("up",))
            return matrix_of_step(tag, {name: self.numbers(a.get(name, "0 0 1"), element) for name in ("origin", "target", "up")}, place)
        if tag == "rotate":
            a = self.attributes(element, ("angle",), ("value", "x", "y", "z"))
            inner = Element(tag, {k: v for k, v in element.attributes.items() if k != "angle"}, place)
            return matrix_of_step(tag, {"axis": self.vector(inner, 0.0), "angle": self.numbers(a["angle"], element)[0]}, place)
        return matrix_of_step(tag, self.vector(element, 1.0 if tag == "scale" else 0.0), place)


def check_version(element: Element) -> None:
    """Accept versions 2 and 3 of the format; older ones name their properties differently."""
    version = element.attributes.get("version")
    if version is None:
        raise SceneError("<scene> needs the attribute 'version', such as version=\"3.0.0\"", element.place)
    if not re.fullmatch(r"\d+(\.\d+)*", version) or int(version.split(".")[0]) not in (2, 3):
        raise SceneError(f"the scene's version is {version!r}; supported: 2.x and 3.x", element.place)


def read_xml(path: pathlib.Path, parameters: Mapping[str, str], paths: Paths) -> Node:
    """The tree of an XML file."""
    return XmlReader(parameters, paths).scene(path)
