# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of tests and of the example."""

import math

import bpy


def empty(width=160, height=96):
    """The default scene without objects, a camera at the origin that looks along -Z, and renders of this size."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = width, height
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.context.view_layer.update()
    return scene


def plate_before_wall():
    """A wall at distance 5 and a plate of 1 x 1 at distance 4 in front of it."""
    scene = empty()
    bpy.ops.mesh.primitive_plane_add(size=60, location=(0, 0, -5))
    bpy.ops.mesh.primitive_plane_add(size=1, location=(0, 0, -4))
    bpy.context.view_layer.update()
    return scene


def shelf():
    """Blocks and balls on a floor before a wall, with lamps: what the example shows."""
    scene = empty(640, 360)
    bpy.ops.mesh.primitive_plane_add(size=30)
    bpy.ops.mesh.primitive_plane_add(size=30, location=(0, 2.2, 0), rotation=(math.radians(90), 0, 0))
    for i in range(6):
        bpy.ops.mesh.primitive_cube_add(size=1, location=(i * 1.15 - 3, 1.2 + 0.25 * (i % 2), 0.5 + 0.35 * (i % 3)))
        bpy.context.object.scale.z = 1 + 0.7 * (i % 3)
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.42, segments=48, ring_count=24, location=(i * 1.1 - 2.7, -0.3, 0.42))
        bpy.ops.object.shade_smooth()
    bpy.ops.mesh.primitive_torus_add(location=(1.2, -1.3, 0.25), major_radius=0.6, minor_radius=0.25)
    bpy.ops.object.shade_smooth()
    scene.camera.location = (1.2, -6.2, 2.6)
    scene.camera.rotation_euler = (math.radians(72), 0, math.radians(10))
    bpy.context.view_layer.update()
    return scene
