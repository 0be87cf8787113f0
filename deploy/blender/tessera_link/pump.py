"""What Blender calls: its handlers mark what changed, its timer pumps the link. A program, or a test, calls `pump`
itself."""
import gc
import os
import socket
import traceback
import uuid

import bpy
from bpy.app.handlers import persistent

from . import package
from .link import Link
from .subjects import key_of

PERIOD = 1 / 60  # s
_SLOW = 0.1  # s, while nothing is linked to

link = None  # the one link of this Blender
_keys = {}  # of collections of this file that were linked, by their names


def start(collection, address="", token_file="", keys="", package_folder=""):
    """Links a collection. ImportError: there is no package `tessera`."""
    global link
    tessera = package.find(package_folder)
    stop()
    gc.collect()  # what is there now is looked through once, at a button's press, and not while the link grows
    gc.freeze()
    way = {name: value for name, value in (("address", address), ("token_file", token_file), ("keys", keys)) if value}
    link = Link(tessera, way, collection, _link_key(collection))
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=PERIOD)
    return link


def stop():
    global link
    if link is not None:
        link.close()
        link = None
        gc.unfreeze()


def pump():
    """Once; the link, or None."""
    if link is not None:
        operators = bpy.context.window_manager.operators
        link.gestures.token = (len(operators), operators[-1].as_pointer()) if len(operators) else 0
        link.pump()
    return link


def _link_key(collection):
    """By which the collection is found again at the wall. A file that has none yet is known by its place and this
    machine: if it is never saved with its link, it is found all the same."""
    key = key_of(collection) or _remembered(collection.name)
    if not key and bpy.data.filepath:
        place = f"{socket.gethostname()}\0{os.path.abspath(bpy.data.filepath)}\0{collection.name}"
        key = uuid.uuid5(uuid.NAMESPACE_URL, place).hex
    key = key or uuid.uuid4().hex
    _keys[collection.name] = key
    return key


def _remembered(name):
    """While nothing is linked, undo may go back to before the collection had its key."""
    everything = (*bpy.data.collections, *(scene.collection for scene in bpy.data.scenes))
    return _keys.get(name) if all(key_of(each) != _keys.get(name) for each in everything) else None


def _tick():
    if link is None:
        return None
    before = (link.courier.state, link.waiting, len(link.notes))
    try:
        pump()
    except Exception as error:  # a timer that raises is not called again
        traceback.print_exc()
        link.note(("fault",), f"a fault of this add-on: {type(error).__name__}: {error}")
    if link is not None and (link.courier.state, link.waiting, len(link.notes)) != before:
        for window in bpy.context.window_manager.windows:
            for area in window.screen.areas:
                if area.type == "VIEW_3D":
                    area.tag_redraw()
    return PERIOD if link is not None and link.courier.state == "linked" else _SLOW


@persistent
def _updated(scene, depsgraph):
    if link is not None:
        link.mark(depsgraph.updates)


@persistent
def _undone(scene, *_):
    if link is not None:
        link.mark_all(undone=True)


@persistent
def _saving(*_):
    if link is not None:
        link.keep()


@persistent
def _loading(*_):
    stop()  # another file has other objects
    _keys.clear()


_HANDLERS = {"depsgraph_update_post": _updated, "undo_post": _undone, "redo_post": _undone, "save_pre": _saving,
             "load_pre": _loading}


def register():
    for name, handler in _HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)


def unregister():
    stop()
    _keys.clear()
    for name, handler in _HANDLERS.items():
        if handler in getattr(bpy.app.handlers, name):
            getattr(bpy.app.handlers, name).remove(handler)
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
