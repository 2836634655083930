"""XML of robots: parsed without entities, so that no file can read another or fill the memory."""

import re
from pathlib import Path

from lxml import etree

from ..file_text import decoded, read_bytes
from ..toml_file import DescriptionError

ROOT = "robot"
_FIRST_TAG = re.compile(r"<([A-Za-z][\w:.-]*)")
_DECLARED = re.compile(rb"""<\?xml[^>]*\bencoding\s*=\s*["']([\w.:-]+)["']""")
_UTF_16 = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16", b"<\0": "utf-16-le", b"\0<": "utf-16-be"}
"""Encodings by the first two bytes: a byte order mark, or the first character without one."""


def read_xml(path: str | Path) -> str:
    """The text of an XML file, in the encoding of its byte order mark, or that it declares.

    Raises:
        DescriptionError: The file cannot be read, is too long, or is not in its encoding.
    """
    content = read_bytes(path)
    declared = _DECLARED.match(content)
    encoding = declared[1].decode() if declared else "utf-8"
    if encoding.lower() in ("utf-8", "utf8", "utf-16"):
        encoding = "utf-8-sig"
    return decoded(str(path), content, _UTF_16.get(content[:2], encoding))


def is_urdf(text: str) -> bool:
    """Whether the first element of an XML text is that of a URDF."""
    without_comments = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    first = _FIRST_TAG.search(without_comments)
    return first is not None and first[1].rpartition(":")[2] == ROOT


def _parser(*, recover: bool = False) -> etree.XMLParser:
    return etree.XMLParser(
        encoding="utf-8",
        resolve_entities=False,
        no_network=True,
        huge_tree=False,
        recover=recover,
    )


def parsed(file: str, text: str, root: str = ROOT) -> etree._Element:
    """The root element of an XML text, the namespace of which is dropped from all its elements.

    Args:
        file: Name of the file in errors.
        text: XML.
        root: The name that the root element must have.

    Raises:
        DescriptionError: The text is no XML, has a document type, or has another root.
    """
    parser = _parser()
    try:
        element = etree.fromstring(text.encode(), parser)
    except etree.XMLSyntaxError as error:
        # Exporters write prefixes, such as drake:, that no xmlns declares. The log of the error
        # itself may hold those of other texts.
        if any(entry.domain != etree.ErrorDomains.NAMESPACE for entry in parser.error_log):
            reason = f"well-formed XML ({error.msg})"
            raise DescriptionError(file, error.lineno, "", None, reason) from error
        element = etree.fromstring(text.encode(), _parser(recover=True))
    _drop_namespace(element)
    tag, line = str(element.tag), element.sourceline
    about = f"<{tag}>"
    if element.getroottree().docinfo.doctype:
        expected = "no document type, which could define entities"
        raise DescriptionError(file, line, about, None, expected)
    if tag != root:
        raise DescriptionError(file, line, about, tag, f"a <{root}>")
    return element


def _drop_namespace(root: etree._Element) -> None:
    """Drops the namespace of the root, a default one mostly, from the names of its elements."""
    namespace = etree.QName(root).namespace
    for element in root.iter(f"{{{namespace}}}*") if namespace else ():
        element.tag = etree.QName(element).localname
