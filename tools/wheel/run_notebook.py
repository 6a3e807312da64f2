"""Executes a notebook in a fresh folder, with the Python that runs this script.

In: the path of the notebook. Out: exit status 1 and the error if a cell fails. The notebook itself is not changed.
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
        # `python3` is the kernel of this interpreter.
        nbclient.NotebookClient(notebook, timeout=120, kernel_name="python3", resources={"metadata": {"path": folder}}).execute()
    n_cells = sum(cell.cell_type == "code" for cell in notebook.cells)
    print(f"{arguments.notebook}: {n_cells} cells")


if __name__ == "__main__":
    main()
