"""The pages in the language of a person: what they say in HTML is looked up as everywhere."""

import json
import re
from collections.abc import Callable
from functools import cache
from html import escape, unescape
from typing import Any

from levilab.texts.text import Text, in_language, language_of, languages

#: What a person sees or hears of HTML: text between elements, and these attributes.
_SAID = re.compile(r'(>\s*)([^<>\s{][^<>]*?)(?=\s*<)|(\b(?:title|aria-label|placeholder|data-drop)=")([^"]+)(?=")')


def change_texts(html: str, change: Callable[[str], str]) -> str:
    """Return a page with each text that a person sees or hears changed."""

    def replace(found: re.Match[str]) -> str:
        before, text = (one for one in found.groups() if one is not None)
        return before + escape(change(unescape(text)))

    return _SAID.sub(replace, html)


def data_in(code: str, data: Any) -> Any:
    """Return plain data with each text of them in a language."""
    if isinstance(data, dict):
        return {key: data_in(code, one) for key, one in data.items()}
    if isinstance(data, list | tuple):
        return [data_in(code, one) for one in data]
    return in_language(data, code) if isinstance(data, Text) else data


@cache
def page_in(html: str, code: str) -> str:
    """Return a page in a language: with its texts, the list of languages, and what its modules look up."""
    page = change_texts(html, lambda text: in_language(text, code))
    options = (f'<option value="{one}"{" selected" * (one == code)}>{language_of(one).name}' for one in languages())
    table = json.dumps({"decimal": language_of(code).decimal, "texts": dict(language_of(code).page)})
    table = table.replace("<", r"\u003c")  # else a text could end the element
    for empty, whole in (
        ('lang="en"', f'lang="{code}"'),
        ('id="texts">', f'id="texts">{table}'),
        ('id="language">', f'id="language">{"".join(options)}'),
    ):
        page = page.replace(empty, whole, 1)
    return page
