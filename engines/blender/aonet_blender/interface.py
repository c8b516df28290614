# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties of a scene, operators, and the panel in the render properties."""

from __future__ import annotations

from pathlib import Path

import aonet
import bpy
from bpy.app.handlers import persistent
from bpy.props import BoolProperty, EnumProperty, FloatProperty, PointerProperty, StringProperty

from . import camera, nodes, occlusion

_METHODS = (
    ("fast", "Fast", "The smallest network"),
    ("balanced", "Balanced", "The default network"),
    ("high", "High", "The best network, several times slower"),
    ("agtao:tuned", "No network", "Attenuated horizon search"),
    ("arcs:deep", "No network, layers", "Connected arcs; reads the second layer"),
)


class AonetSettings(bpy.types.PropertyGroup):
    """How to compute a scene's ambient occlusion."""

    radius: FloatProperty(name="Radius", description="Length of the occlusion rays", default=1.0, min=1e-4, unit="LENGTH")
    method: EnumProperty(name="Method", items=_METHODS, default="balanced")
    margin: FloatProperty(
        name="Overscan",
        description="Guard band on each side, as a share of the picture: occluders outside of the frame count",
        default=0.1, min=0.0, max=0.5, subtype="FACTOR",
    )
    second_layer: BoolProperty(
        name="Second Layer", description="Render what lies behind the visible surfaces, too; Balanced, High and Arcs read it",
        default=False,
    )
    note: BoolProperty(
        name="Camera in Files",
        description="Write the camera into the note of every render, so that the program aonet reads Blender's EXR files alone",
        default=False,
    )
    folder: StringProperty(name="Folder", description="Where animations are written", default="//ambient_occlusion", subtype="DIR_PATH")

    def options(self) -> occlusion.Options:
        """As the computation takes them."""
        return occlusion.Options(self.radius, self.method, self.margin, self.second_layer)


def _compute(operator: bpy.types.Operator, scene: bpy.types.Scene):
    """Visibility of the scene, or None after an error that the user sees."""
    try:
        return occlusion.visibility(scene, scene.aonet.options())
    except (ValueError, RuntimeError, OSError) as error:
        operator.report({"ERROR"}, str(error))
        return None


class AonetRender(bpy.types.Operator):
    """Compute the ambient occlusion of the current frame into the image "Ambient Occlusion"."""

    bl_idname = "aonet.render"
    bl_label = "Render Ambient Occlusion"

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Leaves the image and the compositor group."""
        values = _compute(self, context.scene)
        if values is None:
            return {"CANCELLED"}
        nodes.group(occlusion.to_image(values))
        self.report({"INFO"}, f"Image “{occlusion.IMAGE}”, mean visibility {values.mean():.3f}")
        return {"FINISHED"}


class AonetAnimation(bpy.types.Operator):
    """Compute the ambient occlusion of all frames of the scene into PNG files of 16 bits."""

    bl_idname = "aonet.render_animation"
    bl_label = "Render Animation"

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Writes one file a frame, under the frame's number; the current frame stays as it was."""
        scene = context.scene
        folder = Path(bpy.path.abspath(scene.aonet.folder))
        current = scene.frame_current
        try:
            folder.mkdir(parents=True, exist_ok=True)
            for frame in range(scene.frame_start, scene.frame_end + 1, scene.frame_step):
                scene.frame_set(frame)
                values = _compute(self, scene)
                if values is None:
                    return {"CANCELLED"}
                aonet.save_ao(folder / f"{frame:04}.png", values)
        except OSError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        finally:
            scene.frame_set(current)
        return {"FINISHED"}


class AonetPanel(bpy.types.Panel):
    """Ambient occlusion in the render properties."""

    bl_idname = "RENDER_PT_aonet"
    bl_label = "Ambient Occlusion (aonet)"
    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "render"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Settings, then buttons."""
        settings = context.scene.aonet
        column = self.layout.column()
        column.use_property_split = True
        for name in ("radius", "method", "margin", "second_layer"):
            column.prop(settings, name)
        column.operator(AonetRender.bl_idname)
        column.prop(settings, "folder")
        column.operator(AonetAnimation.bl_idname)
        column.prop(settings, "note")


@persistent
def write_note(scene: bpy.types.Scene, *_: object) -> None:
    """Before a render: writes the camera into its note, where the scene asks for it."""
    if scene.aonet.note and scene.camera is not None:
        scene.render.use_stamp_note = True
        scene.render.stamp_note_text = camera.description(scene, scene.camera, scene.aonet.radius)


_CLASSES = (AonetSettings, AonetRender, AonetAnimation, AonetPanel)


def register() -> None:
    """Adds settings, operators, panel and handler."""
    for kind in _CLASSES:
        bpy.utils.register_class(kind)
    bpy.types.Scene.aonet = PointerProperty(type=AonetSettings)
    bpy.app.handlers.render_pre.append(write_note)


def unregister() -> None:
    """Removes them."""
    bpy.app.handlers.render_pre.remove(write_note)
    del bpy.types.Scene.aonet
    for kind in reversed(_CLASSES):
        bpy.utils.unregister_class(kind)
