"""How the pages become a site: ``make site``.  What is general stands here, what is done to pages in docs/building."""

from __future__ import annotations

import sys
from importlib import metadata
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

project = "levilab"
release = metadata.version("levilab")
author = "the authors of levilab"
language = "en"
html_title = f"levilab {release}"
copyright = "the authors of levilab, MIT licence"  # noqa: A001 - Sphinx's name

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "building.commands",
    "building.docstrings",
    "building.indices",
    "building.mathml",
    "building.outside_pages",
    "building.words",
    "building.wrapping",
]
exclude_patterns = ["building"]

# --- pages ---
myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
smartquotes = False

# --- the Python API ---
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
maximum_signature_line_length = 88
# of a module what its page names, without what serves other rooms
autodoc_default_options = {"members": "", "exclude-members": "model_config, contents, write"}
autodoc_class_signature = "mixed"
add_module_names = False
python_use_unqualified_type_names = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
napoleon_attr_annotations = False
default_role = "code"

# --- what it looks like ---
html_theme = "furo"
html_show_sourcelink = False
html_copy_source = False
html_last_updated_fmt = None
html_theme_options = {"navigation_with_keys": True}
html_static_path = ["building/style"]
html_css_files = ["site.css"]
html_js_files = ["copy.js"]
html_favicon = "building/style/top.svg"
html_search_scorer = str(Path(__file__).parent / "building/scorer.js")
pygments_style = "friendly"
pygments_dark_style = "monokai"
