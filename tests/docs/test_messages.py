"""The messages that docs/messages.md quotes stand in the program."""

import ast
import re

import pytest

from support.messages import QUOTED
from support.sources import sources


def as_printed(node):
    """A literal text, with ``…`` for its values; empty for another node."""
    if isinstance(node, ast.JoinedStr):
        return "".join(as_printed(part) or "…" for part in node.values)
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return re.sub(r"\{[^{}]*\}", "…", node.value)
    return ""


@pytest.fixture(scope="module")
def texts():
    """Every literal text of the program."""
    nodes = (node for tree in sources().values() for node in ast.walk(tree))
    return "\n".join(filter(None, map(as_printed, nodes)))


def test_the_page_quotes_messages():
    assert 10 <= len(QUOTED) <= 27


def test_each_quoted_message_stands_in_the_program(texts):
    assert [message for message in QUOTED if message.removesuffix("…") not in texts] == []
