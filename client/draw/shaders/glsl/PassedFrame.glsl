// llvmpipe of Mesa 22 fetches each number of a uniform block once for every pixel, one after the other; what comes from
// a vertex and is not interpolated it reads once for all. A triangle around the screen has three vertices.

PASSED vec4 worldRow0, worldRow1, worldRow2, sky, ground;
#ifdef ENVIRONMENT
PASSED vec4 surround[9];
#endif
#ifdef STUDIO
PASSED vec4 studio[2];
#endif
#if LIGHTS >= 3
PASSED vec4 suns[6], toCorner, acrossPixel, upPixel;  // the way to a place in the picture, of any length
#else
PASSED vec4 slices, shadows, clipPerPixel;
PASSED mat4 eye_T_clip;
#endif
