"""Lights: watts in Blender; at the wall a light of 1, one unit away, makes a white surface white."""
import math

TYPES = {"POINT": "PointLight", "SPOT": "SpotLight", "SUN": "DirectionalLight"}
_OF_SUN = math.pi  # W/m² on a white surface for a radiance of 1
_OF_POINT = 4 * math.pi * math.pi  # W into all directions, for the same at one metre
_WIDEST = math.pi / 2  # float32 of it is what the wall takes at most


def _factor(light):
    return _OF_SUN if light.type == "SUN" else _OF_POINT


def read(light):
    """The fields of the wall's light of that type."""
    fields = {"color": tuple(max(0.0, part) for part in light.color),
              "intensity": max(0.0, light.energy) / _factor(light), "shadows": bool(light.use_shadow)}
    if light.type == "SPOT":
        outer = min(light.spot_size / 2, _WIDEST - 1e-6)
        fields["outerAngle"], fields["innerAngle"] = outer, outer * (1 - light.spot_blend)
    return fields


def write(light, name, value):
    """A field that was changed at the wall. False: Blender has no such thing, and keeps its own."""
    if name == "color":
        light.color = value
    elif name == "intensity":
        light.energy = value * _factor(light)
    elif name == "outerAngle":
        light.spot_size = 2 * value
    elif name == "innerAngle":
        light.spot_blend = min(max(1 - 2 * value / light.spot_size, 0), 1)
    elif name == "shadows":
        light.use_shadow = value
    else:
        return False
    return True
