// llvmpipe of Mesa 22 fetches each number of a uniform block once for every pixel, one after the other; what comes from
// a vertex and is not interpolated it reads once for all. A triangle around the screen has three vertices.

PASSED vec4 worldRow0, worldRow1, worldRow2, sky;
#ifdef ENVIRONMENT
PASSED vec4 surround[9];
#else
PASSED vec4 ground;
#endif
#ifdef STUDIO
PASSED vec4 studio[2];
#endif
#ifdef SUNS_ALONE
PASSED vec4 suns[6], toCorner, acrossPixel, upPixel;  // the way to a place in the picture, of any length
#else
PASSED vec4 clipPerPixel;
PASSED mat4 eye_T_clip;
#if LIGHTS == LIGHTS_FEW
PASSED vec4 few[10];
#else
PASSED vec4 slices;
#ifdef ONE_SUN
// Towards it; its radiance; of its three views, the finest first, three rows each (ShadowMaps.h); how large pixels of
// their maps are; their layers; what is inside of a map, and well inside. clipPerPixel.zw: the size of a map's pixel.
PASSED vec4 sunTowards, sunRadiance, sunRows[9], sunLayers, sunInside;
#else
PASSED vec4 shadows;
#endif
#endif
#endif
