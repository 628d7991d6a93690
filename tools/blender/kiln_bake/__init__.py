"""Kiln in Blender: a panel in Render > Bake and in the sidebar."""

import bpy

from . import bake, cage

CHOICES = {
    "mode": (
        ("SELECTED", "Selected to Active", "The active object gets maps of the other selected objects"),
        ("NAME", "By Name", "NAME_low gets maps of NAME_high and NAME_high_*, among the selected objects or all objects"),
        ("COLLECTIONS", "Collections", "The objects of one collection get maps of the objects of another"),
        ("NEW", "New Low Poly", "Makes a low poly with UVs from the selected objects"),
    ),
    "maps": (
        ("normal", "Normal", "In tangent space"),
        ("ao", "Occlusion", ""),
        ("color", "Color", "From the high poly's picture, else from its color attribute"),
        ("curvature", "Curvature", ""),
        ("height", "Height", "Distance between the surfaces, world units"),
        ("thickness", "Thickness", ""),
        ("id", "ID", "One color per object"),
        ("position", "Position", ""),
        ("normal_object", "Object Normal", "In world space"),
    ),
    "match": tuple((name, name.capitalize(), "") for name in ("ray", "closest", "visibility", "hybrid", "views")),
    "sets": tuple(
        (name, name.upper() if name == "udim" else name.capitalize(), "")
        for name in ("auto", "none", "material", "object", "udim")
    ),
}


def enum_property(name, label, default, **more):
    return bpy.props.EnumProperty(name=label, items=CHOICES[name], default=default, **more)


class KilnSettings(bpy.types.PropertyGroup):
    mode: enum_property("mode", "Bake", "SELECTED")
    low_collection: bpy.props.PointerProperty(name="Low", type=bpy.types.Collection)
    high_collection: bpy.props.PointerProperty(name="High", type=bpy.types.Collection)
    maps: enum_property("maps", "Maps", {"normal"}, options={"ENUM_FLAG"})
    size: bpy.props.IntProperty(name="Size", default=2048, min=16, max=16384, description="Texels per side")
    samples: bpy.props.IntProperty(name="Samples", default=1, min=1, max=16, description="N x N samples per texel")
    ao_rays: bpy.props.IntProperty(name="Occlusion Rays", min=0, max=4096, description="Rays per sample; 0: Kiln's default")
    sets: enum_property("sets", "Texture Sets", "auto")
    match: enum_property("match", "Match", "ray")
    cage: bpy.props.FloatProperty(
        name="Cage",
        min=0,
        subtype="DISTANCE",
        description="Rays start at this distance outside and run inward; 0: rays run both ways from the surface",
    )
    show_cage: bpy.props.BoolProperty(name="Show Cage", update=lambda self, context: cage.set_shown(self.show_cage))
    max_distance: bpy.props.FloatProperty(
        name="Max Distance", min=0, subtype="DISTANCE", description="Maximum distance of matches; 0: Kiln's default"
    )
    by_error: bpy.props.BoolProperty(
        name="By Error", description="Choose match, map size, and faces of a new low poly by the error"
    )
    max_error: bpy.props.FloatProperty(
        name="Max Error", default=1.5, min=0.01, max=90, description="Mean angle between rendered normals, degrees"
    )
    faces: bpy.props.IntProperty(name="Faces", default=10_000, min=4, description="Triangles of the new low poly")
    flip_y: bpy.props.BoolProperty(name="Flip Green", description="The green channel points down, as in DirectX")
    two_sided: bpy.props.BoolProperty(name="Two-Sided", description="Rays hit back faces of the high poly, too")
    folder: bpy.props.StringProperty(
        name="Folder",
        subtype="DIR_PATH",
        description="Folder for EXR files; empty: images within this file, which are not saved yet",
    )


class KilnPanel:
    bl_label = "Kiln"

    def draw(self, context):
        layout, settings, job = self.layout, context.scene.kiln_bake, bake.Job.running
        layout.use_property_split = True
        layout.use_property_decorate = False
        if job:
            layout.progress(factor=job.done, text=job.stage or "baking")
            layout.operator("kiln.cancel", icon="CANCEL")
            return
        layout.prop(settings, "mode")
        if settings.mode == "COLLECTIONS":
            layout.prop(settings, "low_collection")
            layout.prop(settings, "high_collection")
        grid = layout.grid_flow(columns=3, even_columns=True, align=True)
        grid.use_property_split = False
        for name, *_ in CHOICES["maps"]:
            grid.prop_enum(settings, "maps", name)
        for name in ("size", "samples", "cage", "show_cage", "max_distance", "two_sided", "flip_y"):
            layout.prop(settings, name)
        if "ao" in settings.maps:
            layout.prop(settings, "ao_rays")
        layout.prop(settings, "by_error")
        layout.prop(settings, "max_error" if settings.by_error else "match")
        if settings.mode != "NEW":
            layout.prop(settings, "sets")
        elif not settings.by_error:
            layout.prop(settings, "faces")
        layout.prop(settings, "folder")
        layout.operator("kiln.bake", icon="RENDER_STILL")


class KILN_PT_sidebar(KilnPanel, bpy.types.Panel):
    bl_idname = "KILN_PT_sidebar"
    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "Kiln"


class KILN_PT_render(KilnPanel, bpy.types.Panel):
    bl_idname = "KILN_PT_render"
    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "render"
    bl_options = {"DEFAULT_CLOSED"}


CLASSES = (KilnSettings, bake.KILN_OT_bake, bake.KILN_OT_cancel, KILN_PT_sidebar, KILN_PT_render)


def register():
    # A subpanel of Render > Bake if Cycles is enabled, which defines that panel.
    if hasattr(bpy.types, "CYCLES_RENDER_PT_bake"):
        KILN_PT_render.bl_parent_id = "CYCLES_RENDER_PT_bake"
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Scene.kiln_bake = bpy.props.PointerProperty(type=KilnSettings)


def unregister():
    cage.set_shown(False)
    if bake.Job.running:
        bake.Job.running.stop()
    del bpy.types.Scene.kiln_bake
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
