"""Where the package `tessera` is: the client that this add-on stands on."""
import importlib
import os
import pathlib
import sys

BUNDLED = pathlib.Path(__file__).parent / "lib"  # in the zip, it comes with the add-on


def places(said=""):
    """Folders to look in, in this order; `said`: by the person, in the preferences."""
    return [folder for folder in (said, os.environ.get("TESSERA_PYTHON", ""), str(BUNDLED)) if folder
            and os.path.isdir(folder)]


def find(said=""):
    """The package. ImportError says where it was looked for."""
    for folder in places(said):
        if os.path.isfile(os.path.join(folder, "tessera", "__init__.py")) and folder not in sys.path:
            sys.path.insert(0, folder)
    try:
        return importlib.import_module("tessera")
    except ImportError as error:
        looked = ", ".join(places(said)) or "no folder of its own"
        raise ImportError(f"the Python package tessera was not found ({error}); looked in {looked} and where Blender "
                          f"looks. "
                          "Name its folder in the add-on's preferences, or in TESSERA_PYTHON") from None
