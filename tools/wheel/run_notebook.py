"""Executes a notebook in a fresh folder, with the Python that runs this script.

    run_notebook.py NOTEBOOK

Input: the path of the notebook. The notebook itself is not changed.
Output: the number of cells on stdout.
Exit status: 1 if a cell fails; the error is on stderr.
Needs nbclient and ipykernel.
"""

import argparse
import pathlib
import tempfile

import nbclient
import nbformat


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("notebook", type=pathlib.Path)
    arguments = parser.parse_args()
    notebook = nbformat.read(arguments.notebook, as_version=4)
    nbformat.validate(notebook)
    with tempfile.TemporaryDirectory() as folder:
        # The kernel `python3` is the interpreter that runs this script.
        nbclient.NotebookClient(notebook, timeout=120, kernel_name="python3", resources={"metadata": {"path": folder}}).execute()
    n_cells = sum(cell.cell_type == "code" for cell in notebook.cells)
    print(f"{arguments.notebook}: {n_cells} cells")


if __name__ == "__main__":
    main()
