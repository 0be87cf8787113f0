// What comes with a vertex and of its item.

#ifndef POINTS
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 color;
layout(location = 3) in vec2 texcoord;
layout(location = 4) in vec2 texcoord1;
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
