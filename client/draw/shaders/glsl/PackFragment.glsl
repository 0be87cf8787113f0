// First pass of what is solid: what kReadSurface reads is packed here.

layout(location = 0) out uvec2 outSurface;
#ifdef DETAIL
layout(location = 1) out uvec2 outDetail;
// As GL_RGB9_E5 (OpenGL 4.5, 8.5.2).
uint sharedExponent(vec3 c) {
    c = clamp(c, 0.0, 65408.0);
    float largest = max(max(c.r, c.g), max(c.b, 1e-9));
    int e = max(-16, int(floor(log2(largest)))) + 16;
    if (floor(largest * exp2(float(24 - e)) + 0.5) > 511.0) ++e;
    uvec3 m = uvec3(c * exp2(float(24 - e)) + 0.5);
    return m.r | (m.g << 9u) | (m.b << 18u) | (uint(e) << 27u);
}
#endif

void main() {
#ifdef POINTS
    meetBall();
#endif
    Surface s = surface();
#if !defined(PLAIN) || !defined(POINTS) || (POINTS & POINT_NORMALS) == 0
    uint normalBits = packedNormal(s.normal);
#else
    const uint normalBits = 0u;  // the point's is in its material
#endif
#ifdef PLAIN
    outSurface = uvec2(normalBits | vMaterial.x, vMaterial.y);
#else
    uvec3 c = uvec3(sqrt(clamp(s.base.rgb, 0.0, 1.0)) * 255.0 + 0.5);
    uint material = look.material.x;
    outSurface = uvec2(normalBits | ((material & 63u) << 26u),
                       c.r | (c.g << 8u) | (c.b << 16u) | ((material >> 6u) << 24u));
#endif
#ifdef DETAIL
    outDetail = uvec2(0u);
#if defined(PERSON) || (defined(MAPS) && (MAPS & DETAIL_MAPS) != 0)
    uvec3 bytes = uvec3(clamp(vec3(s.metallic, s.roughness, s.occlusion), 0.0, 1.0) * 255.0 + 0.5);
    outDetail = uvec2(sharedExponent(s.emissive), bytes.x | (bytes.y << 8u) | (bytes.z << 16u) | 0x80000000u);
#endif
#endif
#ifdef MASKED
    float above = aboveCutoff(s);
#if SAMPLES > 1
    // As many samples as the share of the pixel above the cutoff, were alpha a straight slope: an edge without steps.
    float slope = fwidth(s.base.a);
    float share = slope > 1e-4 ? clamp(above / slope + 0.5, 0.0, 1.0) : step(0.0, above);
    int covered = int(share * float(SAMPLES) + 0.5);
    if (covered == 0) discard;
    // Samples that lie across from each other first.
    gl_SampleMask[0] = covered == 1 ? 1 : covered == 2 ? 9 : covered == 3 ? 11 : 15;
#else
    if (above < 0.0) discard;
#endif
#endif
}
