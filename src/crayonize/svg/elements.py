"""The elements of an SVG file by strangers: read within limits, without entities and without
fetching anything.
"""

import os
from dataclasses import dataclass, field
from xml.parsers import expat

from stroke_gen.files import read_bytes

MAX_BYTES = 10_000_000
MAX_DEPTH = 100
MAX_ELEMENTS = 100_000
MAX_ATTRIBUTE = 10_000  # characters; of geometry as many as the file has
MAX_STYLE = 200_000

_GEOMETRY = ("d", "points", "data-force")
# elements whose href would have to be fetched
_FETCHED = ("use", "image", "feImage", "script", "link")


@dataclass
class Element:
    """One element: its name and attributes without namespace, and what it holds."""

    tag: str
    attributes: dict[str, str]
    children: list["Element"] = field(default_factory=list)
    text: str = ""  # of <style> only


def read_svg(path: str | os.PathLike[str]) -> Element:
    """The root element of an SVG file. ValueError, without a name before it, for anything else."""
    return _Reader().read(_bytes(path))


def _bytes(path: str | os.PathLike[str]) -> bytes:
    data = read_bytes(path, MAX_BYTES, "an SVG file")
    if data[:2] == b"\x1f\x8b":
        raise ValueError("is compressed (svgz); unpack it with gunzip first")
    return data


class _Reader:
    """Builds the tree and refuses what a drawing does not need."""

    def __init__(self) -> None:
        self.stack: list[Element] = []
        self.root: Element | None = None
        self.count = 0
        self.parser = expat.ParserCreate(namespace_separator=" ")
        self.parser.buffer_text = True
        self.parser.StartDoctypeDeclHandler = self._doctype
        self.parser.EntityDeclHandler = self._entity
        self.parser.ProcessingInstructionHandler = self._instruction
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._text

    def read(self, data: bytes) -> Element:
        try:
            self.parser.Parse(data, True)
        except expat.ExpatError as error:
            what = expat.ErrorString(error.code)
            raise ValueError(
                f"line {error.lineno}, column {error.offset + 1}: not XML ({what})"
            ) from error
        if self.root is None or self.root.tag != "svg":
            raise ValueError("not SVG: its outermost element is not <svg>")
        return self.root

    def _wrong(self, what: str) -> ValueError:
        return ValueError(f"line {self.parser.CurrentLineNumber}: {what}")

    def _doctype(
        self, _name: str, _system: str | None, _public: str | None, has_internal_subset: int
    ) -> None:
        if has_internal_subset:
            raise self._wrong("declarations inside <!DOCTYPE> are not read; delete them")

    def _entity(self, *_: object) -> None:
        raise self._wrong("entities are not read; delete the declaration")

    def _instruction(self, target: str, _: str) -> None:
        if target == "xml-stylesheet":
            raise self._wrong("refers to a style sheet outside; nothing outside the file is read")

    def _start(self, name: str, given: dict[str, str]) -> None:
        self.count += 1
        if self.count > MAX_ELEMENTS:
            raise self._wrong(f"more than {MAX_ELEMENTS:,} elements")
        if len(self.stack) >= MAX_DEPTH:
            raise self._wrong(f"nested deeper than {MAX_DEPTH} elements")
        element = Element(
            name.rpartition(" ")[2], {key.rpartition(" ")[2]: value for key, value in given.items()}
        )
        self._check(element)
        if self.stack:
            self.stack[-1].children.append(element)
        elif self.root is None:
            self.root = element
        self.stack.append(element)

    def _check(self, element: Element) -> None:
        for key, value in element.attributes.items():
            if (
                key == "href"
                and element.tag in _FETCHED
                and not value.strip().startswith(("#", "data:"))
            ):
                raise self._wrong(
                    f"<{element.tag}> refers to something outside; nothing outside the file is read"
                )
            if (
                len(value) > MAX_ATTRIBUTE
                and key not in _GEOMETRY
                and not value.startswith("data:")
            ):
                raise self._wrong(
                    f"the attribute {key[:40]!r} is longer than {MAX_ATTRIBUTE:,} characters"
                )

    def _end(self, _: str) -> None:
        element = self.stack.pop()
        if element.tag == "style" and "@import" in element.text:
            raise self._wrong(
                "the style refers to something outside; nothing outside the file is read"
            )

    def _text(self, text: str) -> None:
        if self.stack and self.stack[-1].tag == "style":
            self.stack[-1].text += text
            if len(self.stack[-1].text) > MAX_STYLE:
                raise self._wrong(f"a style longer than {MAX_STYLE:,} characters")


def style_rules(root: Element) -> dict[str, dict[str, str]]:
    """What <style> says of a tag, a .class, an #id or a tag.class; other selectors are not
    understood.
    """
    rules: dict[str, dict[str, str]] = {}
    waiting = [root]
    while waiting:
        element = waiting.pop()
        waiting += element.children
        if element.tag == "style":
            for block in _without_comments(element.text).split("}"):
                selectors, _, body = block.rpartition("{")
                if "{" not in selectors and "@" not in selectors:
                    for selector in selectors.split(","):
                        rules.setdefault(selector.strip(), {}).update(declarations(body))
    return rules


def _without_comments(text: str) -> str:
    first, *rest = text.split("/*")
    return first + "".join(part.partition("*/")[2] for part in rest)


def declarations(text: str) -> dict[str, str]:
    """`fill: red; stroke: none` as a dict."""
    pairs = (part.partition(":") for part in text.split(";"))
    return {
        key.strip(): value.replace("!important", "").strip()
        for key, _, value in pairs
        if value.strip()
    }
