"""Settings of the documentation site: `sphinx-build -W -c docs . out/site`.

The source folder is the root of the project, so that the links between its pages are the same files here and there.
"""

import os
import sys
from importlib.util import find_spec
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "extensions"))

import echotruth

# The notebooks run the command of the Python that builds the site.
os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])

project = "echotruth"
author = "The echotruth authors"
copyright = author
version = release = echotruth.__version__

root_doc = "docs/index"
include_patterns = [
    "docs/**",
    "README.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "SECURITY.md",
    "config/README.md",
    "benchmarks/README.md",
    "benchmarks/results/*.md",
]
exclude_patterns = [
    ".*",
    "out",
    "src",
    "tests",
    "validation",
    "profiles",
    "docs/conf.py",
    "docs/extensions",
    "docs/redirect",
    "docs/notebooks/out",
    "**/.snakemake",
    "**/.ipynb_checkpoints",
]
extensions = [
    "sphinx.ext.autodoc",
    "numpydoc",
    "myst_nb",
    "sphinx_copybutton",
    "sphinx_design",
    "command_reference",
    "public_names",
    "project_links",
]
default_role = "code"  # single backticks in docstrings

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath", "smartquotes"]
myst_heading_anchors = 4

nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 600
nb_execution_in_temp = False  # beside first.yaml, which they run; what they make is in docs/notebooks/out
nb_merge_streams = True
nb_output_stderr = "remove"  # lines of progress

autodoc_member_order = "bysource"
autodoc_typehints = "none"  # the sections of the docstrings say type, shape and unit
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False


html_theme = "furo"
html_title = f"echotruth {release}"
html_additional_pages = {"index": "redirect.html"}
templates_path = ["redirect"]
html_static_path = ["static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_show_copyright = False
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True

autodoc_mock_imports = [] if find_spec("torch") else ["torch"]
