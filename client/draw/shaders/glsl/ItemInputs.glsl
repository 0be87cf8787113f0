// What comes with a vertex and of its item.

#ifdef FETCHED
// By the vertex's number, by a function `fetch` that fills these.
layout(binding = 13) uniform usamplerBuffer fetched;
layout(binding = 14) uniform samplerBuffer linearOf;  // an sRGB byte's
vec3 position, normal = vec3(0.0, 0.0, 1.0);
vec4 color = vec4(1.0);
vec2 texcoord = vec2(0.0), texcoord1 = vec2(0.0);
vec4 linearColor(uint sRgbBytes) {
    uvec4 bytes = (uvec4(sRgbBytes) >> uvec4(0, 8, 16, 24)) & 255u;
    ivec3 at8 = ivec3(bytes.rgb);
    return vec4(texelFetch(linearOf, at8.r).r, texelFetch(linearOf, at8.g).r, texelFetch(linearOf, at8.b).r,
                float(257u * bytes.a) * (1.0 / 65535.0));
}
#else
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 color;
layout(location = 3) in vec2 texcoord;
layout(location = 4) in vec2 texcoord1;
#endif
#ifdef TANGENTS
layout(location = 13) in vec4 tangent;
#endif
// Of the item: Program.h, ItemRecord.
#ifdef LARGE
layout(std140, binding = 2) uniform ItemBlock {
    vec4 eyeRow0, eyeRow1, eyeRow2;
    vec4 normalRow0, normalRow1, normalRow2;
    uvec2 itemSize;
    uvec2 node;
};
#else
layout(location = 5) in vec4 eyeRow0;
layout(location = 6) in vec4 eyeRow1;
layout(location = 7) in vec4 eyeRow2;
layout(location = 8) in vec4 normalRow0;
layout(location = 9) in vec4 normalRow1;
layout(location = 10) in vec4 normalRow2;
layout(location = 11) in uvec2 itemSize;
layout(location = 12) in uvec2 node;
#endif
