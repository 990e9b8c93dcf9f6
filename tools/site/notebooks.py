"""Notebooks of the site: scripts in the percent format, executed, as pages and as files to download."""
import re

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from nbconvert import MarkdownExporter


def read(text):
    """A notebook from a script: "# %% [markdown]" begins a text cell, "# %%" a cell of code."""
    notebook = nbformat.v4.new_notebook()
    notebook.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3", "language": "python"}
    for number, part in enumerate(re.split(r"^# %%", text, flags=re.M)[1:]):
        head, _, body = part.partition("\n")
        if head.strip() == "[markdown]":
            cell = nbformat.v4.new_markdown_cell(re.sub(r"^# ?", "", body, flags=re.M).strip())
        else:
            cell = nbformat.v4.new_code_cell(body.strip())
        cell["id"] = f"cell-{number}"
        notebook.cells.append(cell)
    return notebook


def printed(notebook):
    """The text that the cells of a notebook printed."""
    return "".join(output.get("text", "") for cell in notebook.cells for output in cell.get("outputs", []))


def stage(scripts, folder, working_folder):
    """Executes every notebook, and writes NAME.md, its pictures and NAME.ipynb. An error in a cell ends the program."""
    folder.mkdir()
    for script in sorted(scripts.glob("*.py")):
        notebook = read(script.read_text())
        name = script.stem
        try:
            NotebookClient(notebook, timeout=600, startup_timeout=600, kernel_name="python3",
                           resources={"metadata": {"path": str(working_folder)}}).execute()
        except CellExecutionError as error:
            raise SystemExit(f"tools/site: the notebook {script.name} fails:\n{printed(notebook)}{error.evalue}\n{error}")
        nbformat.write(notebook, folder / f"{name}.ipynb")
        exporter = MarkdownExporter()
        page, resources = exporter.from_notebook_node(
            notebook, {"unique_key": name, "output_files_dir": f"{name}_files"})
        for file, data in resources["outputs"].items():
            (folder / file).parent.mkdir(exist_ok=True)
            (folder / file).write_bytes(data)
        (folder / f"{name}.md").write_text(f"{page}\n{{download}}`Notebook <{name}.ipynb>`\n")
