"""What a person sees: preferences, a panel in the 3D view's sidebar, and its buttons."""
import bpy

from . import pump

_SHOWN_NOTES = 8
_STATES = {"connecting": ("SORTTIME", "Connecting"), "linked": ("LINKED", "Linked"),
           "reconnecting": ("FILE_REFRESH", "Reconnecting"),
           "failed": ("ERROR", "Not linked"), "closed": ("UNLINKED", "Not linked")}


def preferences():
    found = bpy.context.preferences.addons.get(__package__)
    return found.preferences if found is not None else None


class TesseraLinkPreferences(bpy.types.AddonPreferences):
    """Beside the file: a link may have a token in it, which is not for whoever gets the file."""

    bl_idname = __package__

    address: bpy.props.StringProperty(name="Wall",
                                      description="ADDR:PORT of its server, or a page's link (tessera-ctl link --role "
                                                  "editor). "
                                      "Empty: TESSERA_SERVER, or the one wall of this user on this machine")
    token_file: bpy.props.StringProperty(name="Token File", subtype="FILE_PATH",
                                         description="Its first line lets you in at ADDR:PORT. Empty: what "
                                         "the server has left for its own user, or TESSERA_TOKEN")
    keys: bpy.props.StringProperty(name="Key", subtype="DIR_PATH",
                                   description="Folder with your key, for walls of other machines (tessera-keys "
                                               "person)")
    package_folder: bpy.props.StringProperty(name="Package", subtype="DIR_PATH",
                                             description="Folder that holds the Python package tessera. "
                                             "Empty: the one that came with this add-on")

    def draw(self, context):
        for name in ("address", "token_file", "keys", "package_folder"):
            self.layout.prop(self, name)


class TesseraLinkSettings(bpy.types.PropertyGroup):
    """In the file."""

    collection: bpy.props.PointerProperty(name="Collection", type=bpy.types.Collection,
                                          description="What the wall shows: its objects, "
                                          "and those of the collections in it. Empty: the whole scene")
    camera_leads: bpy.props.BoolProperty(name="View Follows Camera",
                                         description="The wall's first user sees from where the scene's camera stands",
                                         update=lambda self, context: _set_view(self))
    units_per_metre: bpy.props.FloatProperty(name="Units per Metre", default=1, min=1e-6, max=1e6,
                                             description="Of the scene, for a metre of the "
                                             "wall, while the view follows the camera",
                                             update=lambda self, context: _set_view(self))


def _set_view(settings):
    if pump.link is not None:
        pump.link.camera_leads, pump.link.units_per_metre = settings.camera_leads, settings.units_per_metre


class TESSERA_OT_link(bpy.types.Operator):
    """Show this collection on the wall, and keep both in step"""

    bl_idname = "tessera.link"
    bl_label = "Link"

    @classmethod
    def poll(cls, context):
        return pump.link is None or pump.link.courier.state == "failed"

    def execute(self, context):
        settings, said = context.scene.tessera_link, preferences()
        words = {} if said is None else {name: bpy.path.abspath(value) if name != "address" else value
                                         for name, value in (
("address", said.address.strip()), ("token_file", said.token_file), ("keys", said.keys),
("package_folder", said.package_folder))}
        try:
            pump.start(settings.collection or context.scene.collection, **words)
        except ImportError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        _set_view(settings)
        return {"FINISHED"}


class TESSERA_OT_unlink(bpy.types.Operator):
    """Let go of the wall, which keeps what it shows. Linked again, both are taken up as they are"""

    bl_idname = "tessera.unlink"
    bl_label = "Unlink"

    @classmethod
    def poll(cls, context):
        return pump.link is not None

    def execute(self, context):
        pump.stop()
        return {"FINISHED"}


class VIEW3D_PT_tessera(bpy.types.Panel):
    bl_label = "Tessera Wall"
    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "Tessera"

    def draw(self, context):
        layout, settings, said, link = self.layout, context.scene.tessera_link, preferences(), pump.link
        layout.use_property_split, layout.use_property_decorate = True, False
        column = layout.column()
        column.enabled = link is None or link.courier.state == "failed"
        if said is not None:
            for name in ("address", "token_file", "keys"):
                column.prop(said, name)
        column.prop(settings, "collection")
        row = layout.row(align=True)
        row.operator("tessera.link", icon="LINKED")
        row.operator("tessera.unlink", icon="UNLINKED")
        layout.use_property_split = False  # these words are long, and the sidebar is narrow
        layout.prop(settings, "camera_leads")
        row = layout.row()
        row.enabled = settings.camera_leads
        row.prop(settings, "units_per_metre")
        if link is not None:
            self._state(layout, link, max(20, int(context.region.width / 8)))

    @staticmethod
    def _state(layout, link, letters):
        icon, word = _STATES[link.courier.state]
        column = layout.box().column(align=True)
        column.label(text=word, icon=icon)
        if link.courier.state != "linked":
            _wrapped(column, link.courier.message, letters)
        column.label(text=f"{len(link.objects)} objects, {link.waiting} waiting")
        column.label(text=f"{link.counts['sent']} changes sent, {link.counts['taken']} taken")
        notes = list(link.notes.values())
        if notes:
            column = layout.box().column(align=True)
            column.label(text=f"{len(notes)} notes", icon="INFO")
            for note in notes[-_SHOWN_NOTES:]:
                _wrapped(column, note, letters)
            if len(notes) > _SHOWN_NOTES:
                column.label(text=f"and {len(notes) - _SHOWN_NOTES} more")


def _wrapped(column, text, letters):
    line = ""
    for word in text.split():
        if line and len(line) + len(word) + 1 > letters:
            column.label(text=line)
            line = ""
        line = f"{line} {word}" if line else word
    column.label(text=line)


_CLASSES = (TesseraLinkPreferences, TesseraLinkSettings, TESSERA_OT_link, TESSERA_OT_unlink, VIEW3D_PT_tessera)


def register():
    for each in _CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Scene.tessera_link = bpy.props.PointerProperty(type=TesseraLinkSettings)


def unregister():
    del bpy.types.Scene.tessera_link
    for each in reversed(_CLASSES):
        bpy.utils.unregister_class(each)
