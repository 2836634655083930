"""XML of robots: parsed without entities, so that no file can read another or fill the memory."""

import re

from lxml import etree

from ..toml_file import DescriptionError

ROOT = "robot"
_FIRST_TAG = re.compile(r"<([A-Za-z][\w:.-]*)")


def is_urdf(text: str) -> bool:
    """Whether the first element of an XML text is that of a URDF."""
    without_comments = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    first = _FIRST_TAG.search(without_comments)
    return first is not None and first[1] == ROOT


def _parser(*, recover: bool = False) -> etree.XMLParser:
    return etree.XMLParser(
        encoding="utf-8",
        resolve_entities=False,
        no_network=True,
        huge_tree=False,
        recover=recover,
    )


def parsed(file: str, text: str, root: str = ROOT) -> etree._Element:
    """The root element of an XML text.

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
    tag, line = str(element.tag), element.sourceline
    about = f"<{tag}>"
    if element.getroottree().docinfo.doctype:
        expected = "no document type, which could define entities"
        raise DescriptionError(file, line, about, None, expected)
    if tag != root:
        raise DescriptionError(file, line, about, tag, f"a <{root}>")
    return element
