"""Bakes from the scene: its inputs, the thread of the bake, and the results in the scene."""

import os
import re
import tempfile
import threading
import warnings

import bpy
import kiln

from . import meshes, results

LOW = re.compile(r"_(low|lo|lp|lowpoly)(\.\d+)?$", re.IGNORECASE)
HIGH = re.compile(r"_(high|hi|hp|highpoly)(_.*)?(\.\d+)?$", re.IGNORECASE)


def low_and_high_objects(context, settings):
    """Returns the objects of the low poly and those of the high poly. Without the former, Kiln makes the low poly."""
    objects_with_faces = [
        item
        for item in context.selected_objects
        if item.type in meshes.TYPES_WITH_FACES or item.instance_type != "NONE"
    ]
    if settings.mode == "NEW":
        return [], objects_with_faces
    if settings.mode == "SELECTED":
        active = context.active_object
        return [active] if active in objects_with_faces else [], [item for item in objects_with_faces if item != active]
    if settings.mode == "NAME":
        found = objects_with_faces if len(objects_with_faces) > 1 else list(context.visible_objects)
        return [item for item in found if LOW.search(item.name)], [item for item in found if HIGH.search(item.name)]
    pair = settings.low_collection, settings.high_collection
    return tuple(list(collection.all_objects) if collection else [] for collection in pair)


def check_folder(folder):
    """Creates the folder of the maps, and checks that it is writable, before the bake."""
    try:
        os.makedirs(folder, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise kiln.Error(f"Folder '{folder}': maps cannot be written there ({reason}). Choose another.") from None


#: Number of faces above which an active object is probably the high poly, so that the user is asked.
MIN_FACES_TO_ASK = 200_000


def ask_if_low_is_dense(context, settings):
    """Returns a question if the active object is probably the high poly; empty otherwise."""
    lows, highs = low_and_high_objects(context, settings)
    if settings.mode != "SELECTED" or not lows or not highs or lows[0].type != "MESH":
        return ""
    low = len(lows[0].data.polygons)
    high = sum(len(item.data.polygons) for item in highs if item.type == "MESH")
    if low < MIN_FACES_TO_ASK or low <= high:
        return ""
    return (
        f"The active object '{lows[0].name}' has {low:,} faces, but the other selected objects have {high:,}. Is it "
        "the low poly? If not, cancel, and make the light mesh active."
    )


class Bake:
    """One bake. It is created and finished on Blender's thread; run() may be called on any thread, since it does not use
    Blender's data."""

    def __init__(self, context):
        settings = context.scene.kiln_bake
        self.lows, highs = low_and_high_objects(context, settings)
        if not highs or not (self.lows or settings.mode == "NEW"):
            raise kiln.Error("Nothing to bake: select objects of a low poly and of a high poly, as the mode describes.")
        self.made, self.notes = settings.mode == "NEW", []
        self.name = (highs[0].name + "_low") if self.made else self.lows[0].name
        self.folder = bpy.path.abspath(settings.folder) if settings.folder else ""
        if self.folder:
            check_folder(self.folder)
        maps = sorted(settings.maps)
        if not maps:
            raise kiln.Error("No map is chosen: choose one.")
        self.size, self.faces = settings.size, settings.faces
        self.max_error = settings.max_error if settings.by_error else None
        self.keywords = {
            "maps": maps,
            "samples": settings.samples,
            "max_distance": settings.max_distance or None,
            "cage": settings.cage or None,
            "two_sided": settings.two_sided,
            "flip_y": settings.flip_y,
        }
        if "ao" in maps and settings.ao_rays:
            self.keywords["ao_rays"] = settings.ao_rays
        if self.max_error is None:
            self.keywords["match"] = settings.match
        self.high, materials = meshes.collect_mesh(context, highs, "high", colored="color" in maps)
        if "color" in maps and (picture := meshes.picture_of(materials)):
            if self.made and self.max_error is not None:
                raise kiln.Error("Colors of pictures cannot be planned by error: turn By Error off, or leave Color out.")
            self.keywords["textures"] = {"color": picture}
        if not self.made:
            self.keywords["sets"] = settings.sets
            self.low, _ = meshes.collect_mesh(context, self.lows, self.name, tangents=True)
            self.notes = [
                f"Apply the scale of '{item.name}' (Ctrl+A) and bake again: the scale differs between axes, so the "
                "object's tangent space differs from that of the baked normals."
                for item in self.lows
                if "normal" in maps and meshes.is_stretched(item.matrix_world)
            ]
            if settings.mode == "NAME":
                self.keywords["match_by"] = "name"

    def run(self, progress):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", kiln.KilnWarning)
            bakes = self._run(progress)
        # Warnings in the reports of bakes belong to the maps; the others come from earlier steps.
        reported = {(told["code"], told["count"]) for bake in bakes.values() for told in bake.report.warnings}
        told = [warning.message for warning in caught if isinstance(warning.message, kiln.KilnWarning)]
        self.notes += [str(message) for message in told if (message.code, message.count) not in reported]
        return bakes

    def _run(self, progress):
        if self.max_error is not None:
            self.keywords["max_error"] = self.max_error
        if not self.made:
            return kiln.bake_sets(self.high, self.low, size=self.size, progress=progress, **self.keywords)
        high = kiln.clean(self.high)
        if self.max_error is not None:
            self.low, baked, _ = kiln.plan(high, size=self.size, progress=progress, **self.keywords)
            if self.low.uvs is None:  # the plan needs no map
                self.low = kiln.unwrap(self.low, size=self.size)
            return {"": baked} if baked else {}
        low = kiln.simplify(high, target=self.faces, progress=progress)
        self.low = kiln.unwrap(low, size=self.size, progress=progress)
        return {"": kiln.bake(high, self.low, size=self.size, progress=progress, **self.keywords)}

    def finish(self, context, bakes):
        """Creates images and connects them in the low poly's materials. Returns warnings."""
        if self.made:
            self.lows = [meshes.new_object(context, self.low, self.name)]
        results.show(self.lows, results.images_by_set(bakes, self.name, self.folder), self.keywords["flip_y"])
        return self.notes + [warning["message"] for bake in bakes.values() for warning in bake.report.warnings]


class Job:
    """Runs a bake on a separate thread."""

    running = None

    def __init__(self, work):
        self.done, self.stage = 0.0, ""
        self.result = self.error = None
        self.stopped = threading.Event()
        self.thread = threading.Thread(target=self._run, args=(work,), daemon=True)
        self.thread.start()

    def _run(self, work):
        try:
            self.result = work.run(self._report)
        except BaseException as error:
            self.error = error

    def _report(self, done, stage):
        self.done, self.stage = done, stage
        return not self.stopped.is_set()

    def stop(self):
        """Stops the bake within half a second."""
        self.stopped.set()


class KILN_OT_bake(bpy.types.Operator):
    """Bake maps of the high poly into images of the low poly's materials"""

    bl_idname = "kiln.bake"
    bl_label = "Bake with Kiln"
    bl_options = {"REGISTER", "UNDO"}
    asked = False
    confirmed: bpy.props.BoolProperty(options={"HIDDEN", "SKIP_SAVE"})

    @classmethod
    def poll(cls, context):
        return context.mode == "OBJECT" and Job.running is None

    def execute(self, context):
        if self.asked:
            return bpy.ops.kiln.bake("INVOKE_DEFAULT", confirmed=True)
        try:
            work = Bake(context)
            return self.done(context, work, work.run(None))
        except kiln.Error as error:
            return self.failed(error)

    def invoke(self, context, event):
        question = ask_if_low_is_dense(context, context.scene.kiln_bake)
        if question and not self.confirmed:
            self.asked = True  # the dialog's OK calls execute()
            manager = context.window_manager
            return manager.invoke_confirm(self, event, title="Bake onto a dense mesh?", message=question)
        try:
            self.work = Bake(context)
        except kiln.Error as error:
            return self.failed(error)
        Job.running = Job(self.work)
        self.timer = context.window_manager.event_timer_add(0.1, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        job = Job.running
        if event.type == "ESC":
            job.stop()
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        for area in context.screen.areas:
            if area.type in {"VIEW_3D", "PROPERTIES"}:
                area.tag_redraw()
        if job.thread.is_alive():
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self.timer)
        Job.running = None
        return self.failed(job.error) if job.error else self.done(context, self.work, job.result)

    def done(self, context, work, bakes):
        try:
            messages = work.finish(context, bakes)
        except ReferenceError:
            return self.failed(kiln.Error("The low poly was deleted during the bake."))
        for message in messages:
            self.report({"WARNING"}, message)
        self.report({"INFO"}, f"Baked {', '.join(sorted({name for bake in bakes.values() for name in bake}))}")
        return {"FINISHED"}

    def failed(self, error):
        self.report({"INFO" if isinstance(error, kiln.Cancelled) else "ERROR"}, str(error))
        return {"CANCELLED"}


class KILN_OT_cancel(bpy.types.Operator):
    """Stop the bake; nothing is changed"""

    bl_idname = "kiln.cancel"
    bl_label = "Cancel"

    def execute(self, context):
        if Job.running:
            Job.running.stop()
        return {"FINISHED"}
