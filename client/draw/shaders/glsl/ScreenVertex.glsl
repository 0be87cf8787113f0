// A triangle around the whole screen.

#ifdef ONE_SUN
layout(binding = 9) uniform samplerBuffer lightTexels;
#endif

void main() {
    vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
#ifdef FRAME_PASSED_ON
    worldRow0 = frame.worldRow0;
    worldRow1 = frame.worldRow1;
    worldRow2 = frame.worldRow2;
    sky = frame.sky;
#ifdef ENVIRONMENT
    surround = frame.surround;
#else
    ground = frame.ground;
#endif
#ifdef STUDIO
    studio = frame.studio;
#endif
#ifdef SUNS_ALONE
    suns = frame.suns;
    const mat4 m = frame.eye_T_clip;
    // At half the depth range: all of it is before the eye.
    acrossPixel = m[0] * frame.clipPerPixel.x;
    upPixel = m[1] * frame.clipPerPixel.y;
    toCorner = 0.5 * m[2] + m[3] - m[0] - m[1];
#else
    eye_T_clip = frame.eye_T_clip;
    clipPerPixel = frame.clipPerPixel;
#if LIGHTS == LIGHTS_FEW
    few = frame.few;
#else
    slices = frame.slices;
#ifdef ONE_SUN
    // The same numbers as `addLight` and `arrives` have for lights of all kinds, by the same operations.
    int sun = int(frame.shadows.x);
    vec3 l = texelFetch(lightTexels, sun).xyz;
    vec4 inside = texelFetch(lightTexels, sun + 9);
    sunTowards = vec4(l * inversesqrt(max(dot(l, l), 1e-8)), texelFetch(lightTexels, sun + 8).x);
    sunRadiance = vec4(texelFetch(lightTexels, sun + 1).rgb, texelFetch(lightTexels, sun + 14).x);
    for (int view = 0; view < 3; ++view)
        for (int row = 0; row < 3; ++row) sunRows[3 * view + row] = texelFetch(lightTexels, sun + 4 + 6 * view + row);
    sunLayers = vec4(texelFetch(lightTexels, sun + 8).z, texelFetch(lightTexels, sun + 14).z,
                     texelFetch(lightTexels, sun + 20).z, texelFetch(lightTexels, sun + 20).x);
    sunInside = vec4(inside.x, inside.z, mix(inside.x, inside.z, 0.01), mix(inside.z, inside.x, 0.01));
    clipPerPixel.zw = frame.shadows.zw;
#else
    shadows = frame.shadows;
#endif
#endif
#endif
#endif
    gl_Position = vec4(corner, SCREEN_DEPTH, 1.0);
}
