"""Settings of Sphinx for the site that docs/build.py makes."""

import sys
import tomllib
from pathlib import Path

SITE = Path(__file__).resolve().parent
sys.path.insert(0, str(SITE))

_PROJECT = tomllib.loads((SITE.parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]

project = "Soft-tissue retraction laboratory"
version = release = _PROJECT["version"]
copyright = "the authors of the project"
language = "en"

extensions = [
    "myst_parser",
    "sphinx_external_toc",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "plain_docstrings",
    "mathml",
]
external_toc_path = str(SITE / "_toc.yml")
suppress_warnings = ["etoc.toctree"]

# Headings get the anchors that GitHub gives them, so that a link holds in both places.
myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath", "colon_fence"]

# each thing stands where it is defined, not where a package hands it on as well
autodoc_default_options = {"members": True, "ignore-module-all": True}
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
# what stands behind a name is prose with units, not the name of a type to link to
napoleon_google_docstring = False
napoleon_use_param = False
napoleon_use_rtype = False
napoleon_custom_sections = [("Attributes", "params_style"), ("Signals", "params_style")]
toc_object_entries = False
add_module_names = False

html_theme = "pydata_sphinx_theme"
html_title = project
html_math_renderer = "mathml"
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {
    "show_prev_next": False,
    "navigation_with_keys": False,
    "header_links_before_dropdown": 8,
    "secondary_sidebar_items": ["page-toc"],
    "footer_end": [],
}
