# SPDX-License-Identifier: GPL-3.0-or-later
"""A compositor group that darkens a picture by the ambient occlusion image."""

from __future__ import annotations

import bpy

#: Name of the group.
GROUP = "Ambient Occlusion"


def group(image: bpy.types.Image) -> bpy.types.NodeTree:
    """The group with inputs Image and Strength, and output Image: Image times the occlusion; made if it does not exist."""
    tree = bpy.data.node_groups.get(GROUP)
    if tree is not None:
        next(node for node in tree.nodes if node.bl_idname == "CompositorNodeImage").image = image
        return tree
    tree = bpy.data.node_groups.new(GROUP, "CompositorNodeTree")
    tree.interface.new_socket("Image", in_out="INPUT", socket_type="NodeSocketColor")
    strength = tree.interface.new_socket("Strength", in_out="INPUT", socket_type="NodeSocketFloat")
    strength.default_value, strength.min_value, strength.max_value = 1.0, 0.0, 1.0
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    occlusion = tree.nodes.new("CompositorNodeImage")
    occlusion.image = image
    factor, colour, other, result = _multiply(tree)
    tree.links.new(start.outputs["Strength"], factor)
    tree.links.new(start.outputs["Image"], colour)
    tree.links.new(occlusion.outputs["Image"], other)
    tree.links.new(result, end.inputs["Image"])
    for x, node in enumerate((start, occlusion, factor.node, end)):
        node.location = (200 * x, 0)
    return tree


def _multiply(tree: bpy.types.NodeTree) -> tuple[bpy.types.NodeSocket, ...]:
    """A node that multiplies colours: factor, both colours, result. Its type depends on Blender's version."""
    try:
        node = tree.nodes.new("CompositorNodeMixRGB")
        node.blend_type = "MULTIPLY"
        return (*node.inputs[:3], node.outputs[0])
    except RuntimeError:
        node = tree.nodes.new("ShaderNodeMix")
        node.data_type, node.blend_type = "RGBA", "MULTIPLY"
        active = [socket for socket in node.inputs if socket.enabled]
        return (*active[:3], next(socket for socket in node.outputs if socket.enabled))
