"""Materials and their pictures: Blender's Principled BSDF and what a Material of the wall has of it."""
import numpy as np

MOST_PIXELS = 4096 * 4096
_FLOATS = {"metallic": "Metallic", "roughness": "Roughness", "clearcoat": "Clearcoat",
           "clearcoatRoughness": "Clearcoat Roughness",
           "transmission": "Transmission"}
_BRIGHTEST = 1e9  # Material.emissive


def principled(material):
    """Its Principled BSDF, or None."""
    if not material.use_nodes or material.node_tree is None:
        return None
    output = material.node_tree.get_output_node("ALL")
    links = output.inputs["Surface"].links if output else ()
    node = links[0].from_node if links else None
    return node if node is not None and node.type == "BSDF_PRINCIPLED" else None


def _between(value, least, most):
    return min(max(float(value), least), most)


def _colour(value, most=1.0):
    return tuple(_between(part, 0.0, most) for part in tuple(value)[:3])


def image_of(material):
    """The picture that its base colour is taken from, or None."""
    shader = principled(material)
    links = shader.inputs["Base Color"].links if shader else ()
    node = links[0].from_node if links else None
    return node.image if node is not None and node.type == "TEX_IMAGE" else None


def read(material):
    """Its numbers as fields of a Material, and what of it is left out, or "". Pictures are objects of their own."""
    shader = principled(material)
    if shader is None:
        said = "" if not material.use_nodes else "no Principled BSDF at its output: its viewport colour is taken"
        fields = {"baseColor": _colour(material.diffuse_color) + (_between(material.diffuse_color[3], 0, 1),),
                  "metallic": _between(material.metallic, 0, 1), "roughness": _between(material.roughness, 0, 1),
                  "emissive": (0.0, 0.0, 0.0)}
        return {**fields, **_surface(material, fields["baseColor"][3])}, said
    inputs = shader.inputs
    left = [name for name in ("Metallic", "Roughness", "Alpha", "Emission", "Normal") if inputs[name].is_linked]
    if inputs["Base Color"].is_linked and image_of(material) is None:
        left.insert(0, "Base Color")
    # A picture stands alone: Blender does not multiply it with the socket's colour.
    colour = (1.0, 1.0, 1.0) if image_of(material) is not None else _colour(inputs["Base Color"].default_value)
    alpha = _between(inputs["Alpha"].default_value, 0, 1)
    strength = float(inputs["Emission Strength"].default_value)
    fields = {name: _between(inputs[socket].default_value, 0, 1) for name, socket in _FLOATS.items()}
    fields["ior"] = _between(inputs["IOR"].default_value, 1, 100)
    fields["baseColor"] = colour + (alpha,)
    fields["emissive"] = tuple(_between(part * strength, 0, _BRIGHTEST)
                               for part in tuple(inputs["Emission"].default_value)[:3])
    return {**fields, **_surface(material, alpha)}, f"nodes at {', '.join(left)} are left out" if left else ""


def _surface(material, alpha):
    mode = {"OPAQUE": "opaque", "CLIP": "mask"}.get(material.blend_method, "blend" if alpha < 1 else "auto")
    return {"doubleSided": not material.use_backface_culling, "alphaMode": mode,
            "alphaCutoff": float(material.alpha_threshold)}


def write(material, name, value):
    """A field that was changed at the wall. False: Blender has no such thing, and keeps its own."""
    shader = principled(material)
    if name == "doubleSided":
        material.use_backface_culling = not value
    elif name == "alphaCutoff":
        material.alpha_threshold = _between(value, 0, 1)
    elif shader is None:
        if name not in ("baseColor", "metallic", "roughness"):
            return False
        setattr(material, {"baseColor": "diffuse_color"}.get(name, name), value)
    elif name == "baseColor":
        if image_of(material) is None:
            shader.inputs["Base Color"].default_value = (*value[:3], 1.0)
        shader.inputs["Alpha"].default_value = value[3]
    elif name == "emissive":
        strength = max(1.0, *value)
        shader.inputs["Emission"].default_value = (*(part / strength for part in value), 1.0)
        shader.inputs["Emission Strength"].default_value = strength
    elif name == "ior":
        shader.inputs["IOR"].default_value = value
    elif name in _FLOATS:
        shader.inputs[_FLOATS[name]].default_value = value
    else:
        return False
    return True


def read_image(image):
    """The fields of an Image, or why there are none."""
    width, height = image.size
    if width * height == 0:
        return None, f"the picture {image.name} has no pixels"
    if width * height > MOST_PIXELS:
        return None, f"the picture {image.name} has {width} × {height} pixels, and {MOST_PIXELS} is the most"
    if image.channels != 4:
        return None, f"the picture {image.name} has {image.channels} channels instead of 4"
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    return {"pixels": pixels.reshape(height, width, 4), "widthPx": width, "heightPx": height}, ""


def bytes_of(pixels, linear):
    """Rows from the top of 8 bits: beside Blender's thread. `linear`: they are light, and the wall takes sRGB."""
    upright = np.clip(pixels[::-1], 0, 1)
    if linear:
        rgb = upright[..., :3]
        upright = np.concatenate([np.where(rgb <= 0.0031308, 12.92 * rgb, 1.055 * np.power(rgb, 1 / 2.4) - 0.055),
                                  upright[..., 3:]], axis=-1)
    return np.ascontiguousarray((upright * 255 + 0.5).astype(np.uint8)).reshape(-1)
