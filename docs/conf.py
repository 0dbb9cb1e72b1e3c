"""How Sphinx builds these pages: `make docs`. The reference is written first, from the code."""

import sys
from pathlib import Path

from lupin_bridge import __version__

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

import generate  # noqa: E402  # it lies beside this file

generate.write_reference(HERE / "reference")

project = html_title = "lupin-twin"
version = release = __version__
extensions = ["myst_parser"]
myst_heading_anchors = 3
nitpicky = True

html_theme = "furo"
templates_path = ["_templates"]
html_static_path = ["_static"]
html_favicon = "../frontend/public/lupin.svg"
html_show_sphinx = html_show_copyright = html_copy_source = False
html_use_index = html_domain_indices = False
