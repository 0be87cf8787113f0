// Uniform blocks: what a frame and what a material is.

layout(std140, binding = 0) uniform FrameBlock {
    mat4 clip_T_eye;
    mat4 eye_T_clip;
    vec4 worldRow0, worldRow1, worldRow2;
    vec4 sky, ground;
    vec4 clipPerPixel;
    vec4 slices;  // how depth makes slices (LightClusters.h); how many lights are everybody's
    vec4 surround[9];  // EnvironmentTexture.h
    vec4 shadows;  // where lights with shadows are said, how many; 1 / width, 1 / height of their maps' texture
    vec4 suns[6];  // towards each, its radiance
    vec4 head;  // of who looks
    vec4 placeRow0, placeRow1, placeRow2;  // from the eye to the world
    vec4 pixelRays;  // of a pixel's place, what of it is a metre before the eye: scale, offset
    vec4 studio[2];  // upwards, how high the eye is; the ground's middle, 1 / reach
    vec4 few[10];  // of each light its place, its radiance: first the one that is infinitely far away
}
#ifdef FRAME_PASSED_ON
frame
#endif
;
layout(std140, binding = 1) uniform LookBlock {
    vec4 baseColor;
    vec4 emissiveAndRoughness;
    vec4 metallic;
    uvec4 material;  // for the light pass: which, and what it alone says of a surface
    // Of each map: two rows that place it (u = row0.xyz * (u, v, 1)), and in row0.w which texture coordinates it takes.
    vec4 place[10];
    vec4 strengths;  // of normals, of occlusion; alpha's cutoff
    vec4 effects;    // transmission, 1 for unlit, lacquer and its roughness
    vec4 specular;   // MaterialTexels, of which metallic.y is the exponent
    vec4 layerPlace[8];  // of each layer, as of maps
    vec4 layers[4];      // mode, strength
} look;
