// What kPackFragment has packed.

// Of one sample there are textures without levels: to look for a level costs llvmpipe more than to fetch.
#if SAMPLES > 1
#define SAMPLE(of, i) texelFetch(of, at, i)
layout(binding = 0) uniform usampler2DMS surfaces;
#else
#define SAMPLE(of, i) texelFetch(of, at)
layout(binding = 0) uniform usampler2DRect surfaces;
#endif

// All before anything is done with one: a processor waits for them together.
#define FETCH_SAMPLES(of) for (int i = 0; i < SAMPLES; ++i) of[i] = SAMPLE(surfaces, i).xy;

vec3 normalOf(uint bits) {
    vec2 oct = vec2(uvec2(bits, bits >> 13u) & 8191u) * (1.0 / 4095.0) - 1.0;
    vec3 n = vec3(oct, 1.0 - abs(oct.x) - abs(oct.y));
    float fold = max(-n.z, 0.0);
    n.xy = mix(n.xy + fold, n.xy - fold, greaterThanEqual(n.xy, vec2(0.0)));
    return normalize(n);
}
vec3 colorOf(uint bits) {
    vec3 root = vec3(uvec3(bits, bits >> 8u, bits >> 16u) & 255u);
    return root * root * (1.0 / 65025.0);
}
#ifdef DETAIL
#if SAMPLES > 1
layout(binding = 8) uniform usampler2DMS details;
#else
layout(binding = 8) uniform usampler2DRect details;
#endif
vec3 emissiveOf(uint bits) {
    return vec3(uvec3(bits, bits >> 9u, bits >> 18u) & 511u) * exp2(float(int(bits >> 27u) - 24));
}
vec3 bytesOf(uint bits) { return vec3(uvec3(bits, bits >> 8u, bits >> 16u) & 255u) / 255.0; }
#endif
uint materialOf(uvec2 surface) { return (surface.x >> 26u) | ((surface.y >> 24u) << 6u); }
// Samples of one material with about the same normal are one surface.
bool sameSurface(uint material, vec3 n, uint otherMaterial, vec3 otherN) {
    return otherMaterial == material && dot(otherN, n) > 0.85;
}
