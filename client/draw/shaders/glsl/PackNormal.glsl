// What the first pass packs: 26 bits of normal (octahedral map: Cigolle et al., "Survey of efficient representations
// for independent unit vectors", 2014), 24 of colour (its square root), 14 of material. What images alone can say goes
// into 64 more: emitted light with a common exponent of its three colours, a byte each of metal, roughness and
// occlusion.

uint packedNormal(vec3 n) {
    // A normal of no length (degenerate triangles, zeros in a file) faces along the view.
    float size = abs(n.x) + abs(n.y) + abs(n.z);
    n = size > 1e-30 ? n * (1.0 / size) : vec3(0.0, 0.0, 1.0);
    vec2 folded = (1.0 - abs(n.yx)) * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(n.xy, vec2(0.0)));
    vec2 oct = n.z >= 0.0 ? n.xy : folded;
    uvec2 octBits = uvec2(clamp(oct * 4095.0 + 4095.5, 0.0, 8191.0));
    return octBits.x | (octBits.y << 13u);
}
