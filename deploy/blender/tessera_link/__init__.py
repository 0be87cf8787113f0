"""An add-on for Blender that shows a collection on a Tessera wall and keeps both in step. README.md beside this folder
has the rest."""
bl_info = {
    "name": "Tessera Wall",
    "author": "Tessera",
    "version": (1, 0, 0),
    "blender": (3, 4, 0),
    "location": "3D View > Sidebar > Tessera",
    "description": "Shows a collection on a display wall, and follows what is changed there",
    "category": "3D View",
}

from . import panel, pump  # noqa: E402


def register():
    panel.register()
    pump.register()


def unregister():
    pump.unregister()
    panel.unregister()
