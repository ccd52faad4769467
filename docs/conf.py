"""Configuration of Sphinx for the documentation: `make docs`."""

from __future__ import annotations

import hashlib
import logging
import os
import shutil
import sys
from importlib.metadata import version as version_of
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "_ext"), str(HERE.parent)]
BUILT = HERE / "_build"

# Tutorials run the command of this environment and checkout, without the colours and progress bars
# that notebooks request for any output.
os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
os.environ["PYTHONPATH"] = os.pathsep.join([str(HERE.parent), os.environ.get("PYTHONPATH", "")])
os.environ |= {"COLUMNS": "100", "NO_COLOR": "1", "TTY_COMPATIBLE": "0", "MPLBACKEND": "agg"}
# Commands keep what Python compiles of the packages, which otherwise each of them compiles again.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
os.environ["IPYTHONDIR"] = str(BUILT / "ipython")
STARTUP = BUILT / "ipython" / "profile_default" / "startup"
STARTUP.mkdir(parents=True, exist_ok=True)
shutil.copy(HERE / "_ext" / "bash_cell.py", STARTUP)
# Messages about the kernel of a page and its connection are suppressed.
(STARTUP.parent / "ipython_kernel_config.py").write_text("c.IPKernelApp.log_level = 40\n")
logging.getLogger("traitlets").setLevel(logging.WARNING)


def digest() -> str:
    """Return a digest of the packages' code, so that notebooks run again after it changes."""
    found = hashlib.sha256()
    for package in ("sa_solver", "wear", "fe_models", "workflow"):
        for file in sorted((HERE.parent / package).rglob("*.py")):
            found.update(file.read_bytes())
    return found.hexdigest()[:16]


project = "fretscale"
author = "the fretscale authors"
project_copyright = author
release = version_of("fretscale")

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "mathml",
    "sphinx_click",
    "sphinx_copybutton",
    "case_reference",
    "gallery_page",
    "library_reference",
    "message_reference",
]
exclude_patterns = ["_build", "**.ipynb_checkpoints"]
nitpicky = True
# Modules mentioned in docstrings have no separate page.
nitpick_ignore_regex = [("py:mod", r"(sa_solver|wear|fe_models)\..*")]

myst_enable_extensions = ["amsmath", "deflist", "dollarmath"]
myst_heading_anchors = 3
suppress_warnings = ["myst.xref_ambiguous"]

nb_execution_mode = "cache"
nb_execution_cache_path = str(BUILT / "executed" / digest())
nb_execution_in_temp = True
nb_execution_show_tb = True  # a cell that fails is a warning, hence an error of the build
nb_execution_timeout = -1  # no limit, because the machine may be busy
nb_merge_streams = True
nb_render_markdown_format = "myst"

autodoc_typehints = "signature"
# Types of attributes are in the signature; as text, names such as np.bool_ would become links.
napoleon_attr_annotations = False
autodoc_type_aliases = {name: name for name in ("Array", "Flags", "Indices", "Mask", "Parameter")}
python_maximum_signature_line_length = 88
python_use_unqualified_type_names = True
toc_object_entries_show_parents = "hide"
autodoc_member_order = "bysource"

html_theme = "furo"
html_math_renderer = "mathml"
html_title = f"fretscale {release}"
html_static_path = ["_static"]
html_css_files = ["fretscale.css"]
html_js_files = ["filter_table.js"]
html_show_sphinx = False
html_theme_options = {"navigation_with_keys": True}
copybutton_exclude = ".linenos, .gp"
