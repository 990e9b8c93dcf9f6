"""Settings of Sphinx. tools/site/build copies this file beside the staged pages."""
import pathlib
import re

HERE = pathlib.Path(__file__).resolve().parent
project = "merkel"
author = "The merkel authors"
project_copyright = author
release = version = re.search(r"project\(merkel VERSION ([0-9.]+)", (HERE / "CMakeLists.txt").read_text()).group(1)

extensions = ["myst_parser", "breathe", "sphinx.ext.githubpages"]
include_patterns = ["**/*.md", "*.md", "**/*.rst"]
exclude_patterns = ["xml"]
myst_heading_anchors = 4
breathe_projects = {"merkel": str(HERE / "xml")}
breathe_default_project = "merkel"
breathe_default_members = ("members",)
cpp_id_attributes = ["MERKEL_REALTIME"]
highlight_language = "text"
smartquotes = False  # they make a dash of the -- of options

html_theme = "furo"
html_title = f"merkel {release}"
html_static_path = ["tools/site/site.css"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
