// A triangle around the whole screen.

void main() {
    vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
#ifdef FRAME_PASSED_ON
    worldRow0 = frame.worldRow0;
    worldRow1 = frame.worldRow1;
    worldRow2 = frame.worldRow2;
    sky = frame.sky;
    ground = frame.ground;
#ifdef ENVIRONMENT
    surround = frame.surround;
#endif
#ifdef STUDIO
    studio = frame.studio;
#endif
#if LIGHTS >= 3
    suns = frame.suns;
    const mat4 m = frame.eye_T_clip;
    // At half the depth range: all of it is before the eye.
    acrossPixel = m[0] * frame.clipPerPixel.x;
    upPixel = m[1] * frame.clipPerPixel.y;
    toCorner = 0.5 * m[2] + m[3] - m[0] - m[1];
#else
    eye_T_clip = frame.eye_T_clip;
    clipPerPixel = frame.clipPerPixel;
    slices = frame.slices;
    shadows = frame.shadows;
#endif
#endif
    gl_Position = vec4(corner, SCREEN_DEPTH, 1.0);
}
