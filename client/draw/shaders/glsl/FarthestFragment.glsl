// Reversed depth: the farthest is the least.

layout(binding = 0) uniform sampler2DMS depths;
layout(location = 0) out float outFarthest;
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    float farthest = texelFetch(depths, at, 0).r;
    for (int i = 1; i < SAMPLES; ++i) farthest = min(farthest, texelFetch(depths, at, i).r);
    outFarthest = farthest;
}
