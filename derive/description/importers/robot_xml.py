"""A safe XML parser, which rejects entities.

A file can therefore not read other files or fill the memory.
"""

import re
from pathlib import Path
from xml.dom import minidom
from xml.parsers.expat import ExpatError

from lxml import etree

from chasles.contract.errors import DescriptionError

from ..file_text import decoded, read_bytes
from ..toml_file import file_error

ROOT = "robot"
_FIRST_TAG = re.compile(r"<([A-Za-z][\w:.-]*)")
_DECLARED = re.compile(rb"""<\?xml[^>]*\bencoding\s*=\s*["']([\w.:-]+)["']""")
_UTF_16 = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16", b"<\0": "utf-16-le", b"\0<": "utf-16-be"}
"""Encodings of XML files by their first two bytes."""


def read_xml(path: str | Path) -> str:
    """Read an XML file.

    The byte order mark or the XML declaration states the encoding of the file. The default is
    UTF-8.

    Raises:
        DescriptionError: The file cannot be read, is too long, or does not have the stated
            encoding.
    """
    content = read_bytes(path)
    declared = _DECLARED.match(content)
    encoding = declared[1].decode() if declared else "utf-8"
    if encoding.lower() in ("utf-8", "utf8", "utf-16"):
        encoding = "utf-8-sig"
    return decoded(str(path), content, _UTF_16.get(content[:2], encoding))


def nearby_document(path: Path) -> minidom.Document | None:
    """Return the content of an XML file such as package.xml, or None if it is invalid."""
    try:
        return minidom.parseString(read_bytes(path))
    except (DescriptionError, ExpatError, ValueError):
        return None


def is_urdf(text: str) -> bool:
    """Whether the first element of an XML text is <robot>."""
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


def parsed(file: str, text: str, root: str | None = ROOT) -> etree._Element:
    """Parse an XML text and return its root element. The namespace is removed.

    Args:
        file: File name in error messages.
        text: XML text.
        root: Required name of the root element, or None to accept any name.

    Raises:
        DescriptionError: The text is not valid XML, has a document type, or has another root
            element.
    """
    parser = _parser()
    try:
        content = text.encode()
    except UnicodeEncodeError as error:
        raise file_error(file, None, "", None, f"UTF-8 text ({error.reason})") from error
    try:
        element = etree.fromstring(content, parser)
    except etree.XMLSyntaxError as error:
        # Some exporters write namespace prefixes, such as drake:, without declaring them. The log
        # of the exception may contain errors of other files, so the log of the parser is used.
        if any(entry.domain != etree.ErrorDomains.NAMESPACE for entry in parser.error_log):
            reason = f"well-formed XML ({error.msg})"
            raise file_error(file, error.lineno, "", None, reason) from error
        element = etree.fromstring(content, _parser(recover=True))
    _drop_namespace(element)
    tag, line = str(element.tag), element.sourceline
    about = f"<{tag}>"
    if element.getroottree().docinfo.doctype:
        expected = "no document type, which could define entities"
        raise file_error(file, line, about, None, expected)
    if root is not None and tag != root:
        raise file_error(file, line, about, tag, f"a <{root}>")
    return element


def local_name(element: etree._Element) -> str:
    """Return the name of an element without its namespace or prefix.

    The prefix need not be declared.
    """
    return str(element.tag).rpartition("}")[2].rpartition(":")[2]


def _drop_namespace(root: etree._Element) -> None:
    namespace = str(root.tag).rpartition("}")[0]
    for element in root.iter(f"{namespace}}}*") if namespace else ():
        element.tag = local_name(element)
