// Passes over the whole screen: light on what the first pass has packed, and samples into pictures.
#include "client/draw/shaders/ShaderText.h"

namespace tessera::shader_text {

// llvmpipe of Mesa 22 fetches each number of a uniform block once for every pixel, one after the other; what comes from
// a vertex and is not interpolated it reads once for all. A triangle around the screen has three vertices.
const char kPassedFrame[] = R"(
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
)";

const char kScreenVertex[] = R"(
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
)";

const char kClearFragment[] = R"(
layout(location = 0) out uvec2 outSurface;
#ifdef DETAIL
layout(location = 1) out uvec2 outDetail;
#endif
void main() {
    outSurface = uvec2(0u);
#ifdef DETAIL
    outDetail = uvec2(0u);
#endif
}
)";

const char kReadSurface[] = R"(
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
)";

// Sorts pixels by the work that they are: a software rasteriser has no jumps, but the depth test leaves out blocks of
// sixteen pixels with which a pass has nothing to do. 0: the background alone; 0.5: all samples show the same;
// 0.75: one surface, its normal or colour differs; 1: may be several, see sameSurface.
const char kClassifyFragment[] = R"(
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    uvec2 of[SAMPLES];
    FETCH_SAMPLES(of)
    uvec2 first = of[0];
    uvec2 all = first, differ = uvec2(0u);
    bvec2 apart = bvec2(false);
    uvec2 oct = uvec2(first.x, first.x >> 13u) & 8191u;
#ifdef DETAIL
    uvec2 detail = SAMPLE(details, 0).xy;
#endif
    for (int i = 1; i < SAMPLES; ++i) {
        uvec2 other = of[i];
        uvec2 bits = other ^ first;
        all |= other;
        differ |= bits;
#ifdef DETAIL
        differ |= SAMPLE(details, i).xy ^ detail;
#endif
        // A twentieth of the octahedron's map is at most 15 degrees.
        uvec2 otherOct = uvec2(other.x, other.x >> 13u) & 8191u;
        apart = bvec2(uvec2(apart) | uvec2(greaterThan(max(oct, otherOct) - min(oct, otherOct), uvec2(400u))) |
                      uvec2(bits.x >> 26u, bits.y >> 24u));
    }
    float work = (differ.x | differ.y) == 0u ? 0.5 : any(apart) ? 1.0 : 0.75;
    // What has to be gone through anyway takes its neighbours along.
    float mixed = work > 0.5 ? 1.0 : 0.0;
    mixed += abs(dFdxFine(mixed));
    mixed += abs(dFdyFine(mixed));
    work = mixed > 0.0 ? max(work, 0.75) : work;
    // A background that is a picture is a surface like others.
    gl_FragDepth = (all.x | all.y) == 0u && surround[1].w < 0.5 ? 0.0 : work;
}
)";

const char kLightFragment[] = R"(
#if SAMPLES > 1
layout(binding = 1) uniform sampler2DMS depths;
#else
layout(binding = 1) uniform sampler2DRect depths;
#endif
layout(binding = 2) uniform samplerBuffer materials;
layout(location = 0) out vec4 outColor;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
#if SAMPLES > 1 && !defined(ONE_SURFACE)
    uvec2 of[SAMPLES];
    FETCH_SAMPLES(of)
    uvec2 surface = of[0];
#else
    uvec2 surface = SAMPLE(surfaces, 0).xy;
#endif
    vec3 n = normalOf(surface.x);
    vec3 base = colorOf(surface.y);
    uint material = materialOf(surface);
    int sampleOf = 0;
    float share = 1.0;
#ifdef DETAIL
    uvec2 detail = SAMPLE(details, 0).xy;
    vec3 emitted = emissiveOf(detail.x), bytes = bytesOf(detail.y);
#endif
#if SAMPLES > 1 && !defined(ONE_SURFACE)
    // One surface is lit once, with the means of its samples. What else there is in the pixel is lit, as one, in a
    // second pass over such pixels only.
    vec3 sumN = n, sumBase = base, restN = vec3(0.0), restBase = vec3(0.0);
    float count = 1.0, restCount = 0.0;
    uint restMaterial = material;
    int restSample = 0;
#ifdef DETAIL
    vec3 sumEmitted = emitted, sumBytes = bytes, restEmitted = vec3(0.0), restBytes = vec3(0.0);
    uint restDetail = 0u;
#endif
    for (int i = 1; i < SAMPLES; ++i) {
        uvec2 other = of[i];
        vec3 otherN = normalOf(other.x);
        vec3 otherBase = colorOf(other.y);
        uint otherMaterial = materialOf(other);
        bool same = sameSurface(material, n, otherMaterial, otherN);
        float weight = same ? 1.0 : 0.0;
        sumN += weight * otherN;
        sumBase += weight * otherBase;
        count += weight;
        bool first = !same && restCount == 0.0;
        restMaterial = first ? otherMaterial : restMaterial;
        restSample = first ? i : restSample;
        restN += (1.0 - weight) * otherN;
        restBase += (1.0 - weight) * otherBase;
        restCount += 1.0 - weight;
#ifdef DETAIL
        uvec2 otherDetail = SAMPLE(details, i).xy;
        vec3 otherEmitted = emissiveOf(otherDetail.x), otherBytes = bytesOf(otherDetail.y);
        restDetail = first ? otherDetail.y : restDetail;
        sumEmitted += weight * otherEmitted;
        sumBytes += weight * otherBytes;
        restEmitted += (1.0 - weight) * otherEmitted;
        restBytes += (1.0 - weight) * otherBytes;
#endif
    }
#ifdef REST
    float inverse = 1.0 / max(restCount, 1.0);
    n = normalize(restN + vec3(0.0, 0.0, 1e-6));
    base = restBase * inverse;
    material = restMaterial;
    sampleOf = restSample;
    share = restCount / float(SAMPLES);
#ifdef DETAIL
    emitted = restEmitted * inverse;
    bytes = restBytes * inverse;
    detail.y = restDetail;
#endif
#else
    n = normalize(sumN);
    base = sumBase / count;
#ifdef DETAIL
    emitted = sumEmitted / count;
    bytes = sumBytes / count;
#endif
#endif
#endif
#if LIGHTS >= 3
    // What is infinitely far away shines the same everywhere: only which way one looks counts.
    vec3 position = toCorner.xyz + gl_FragCoord.x * acrossPixel.xyz + gl_FragCoord.y * upPixel.xyz;
#else
    float depth = SAMPLE(depths, sampleOf).x;
    vec4 eye = eye_T_clip * vec4(gl_FragCoord.xy * clipPerPixel.xy - 1.0, depth, 1.0);
    // Where nothing is it is far away, and a number whose square is one, too: nearly as far as scenes reach
    // (kUtmostCoordinate).
    vec3 position = eye.xyz / max(eye.w, 1e-17);
#endif
#ifdef STUDIO
    // Where nothing is one sees the studio's ground, or farther away its backdrop.
    onGround = material == 0u;
    vec3 way = normalize(position);
    float falls = -dot(studio[0].xyz, way);
    vec3 foot = way * (studio[0].w / max(falls, 1e-4));
    // In reaches of the model.
    float away = distance(foot, studio[1].xyz) * studio[1].w, high = studio[0].w * studio[1].w;
    float lies = falls > 0.0 ? (1.0 - smoothstep(1.0, 6.0, away)) * clamp(20.0 * high, 0.0, 1.0) : 0.0;
    position = onGround ? foot : position;
    n = onGround ? studio[0].xyz : n;
    base = onGround ? vec3(0.34) : base;
#endif
    vec4 emissiveAndRoughness = texelFetch(materials, int(4u * material));
    vec4 metallicLitAndCoat = texelFetch(materials, int(4u * material + 1u));
    Gloss gloss = kPlainGloss;
#ifdef GLOSSY
    gloss.specular = texelFetch(materials, int(4u * material + 2u));
#endif
#if defined(GLOSSY) || defined(SCOPED)
    vec4 shininessAndScopes = texelFetch(materials, int(4u * material + 3u));
    gloss.shininess = shininessAndScopes.x;
    gloss.scopes = uint(shininessAndScopes.z) | (uint(shininessAndScopes.w) << 16u);
#endif
    float occlusion = 1.0;
#ifdef DETAIL
    bool detailed = (detail.y & 0x80000000u) != 0u;
    emissiveAndRoughness = detailed ? vec4(emitted, max(bytes.y, 0.045)) : emissiveAndRoughness;
    metallicLitAndCoat.x = detailed ? bytes.x : metallicLitAndCoat.x;
    occlusion = detailed ? bytes.z : 1.0;
#endif
    Lit lit = light(position, n, base, metallicLitAndCoat.x, emissiveAndRoughness.w, occlusion,
                    metallicLitAndCoat.zw, gloss);
    // 1: light falls on it; 0: the background; -1: its colour is what is seen.
    float litness = metallicLitAndCoat.y;
    vec3 c = emissiveAndRoughness.rgb + max(litness, 0.0) * (lit.diffuse + lit.specular);
#ifdef ENVIRONMENT
    // Where nothing is.
    bool seen = material == 0u && surround[1].w > 0.5;
    vec3 d = vec3(dot(worldRow0.xyz, position), dot(worldRow1.xyz, position), dot(worldRow2.xyz, position));
    c = seen ? mapOf(onSquare(d), 0.0) : c;
    litness = seen ? 0.0 : litness;
#endif
#ifdef STUDIO
    vec3 backdrop = emissiveAndRoughness.rgb * (1.0 + 0.6 * smoothstep(-0.5, 0.3, falls));
    c = onGround ? mix(backdrop, lit.diffuse, lies) : c;
#endif
    c = litness < 0.0 ? base : toneMap(c);
    outColor = vec4(encodeSrgb(c), share);
}
)";

const char kCopyFragment[] = R"(
layout(binding = 0) uniform sampler2DRect picture;
layout(location = 0) out vec4 outColor;
void main() { outColor = vec4(texelFetch(picture, ivec2(gl_FragCoord.xy)).rgb, 0.0); }
)";

const char kSpreadFragment[] = R"(
layout(binding = 1) uniform sampler2DRect rest;
layout(location = 0) out vec4 outColor;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 color = texelFetch(rest, at);
    uvec2 first = SAMPLE(surfaces, 0).xy;
    vec3 n = normalOf(first.x);
    int covered = 0;
    for (int i = 1; i < SAMPLES; ++i) {
        uvec2 other = SAMPLE(surfaces, i).xy;
        covered |= sameSurface(materialOf(first), n, materialOf(other), normalOf(other.x)) ? 0 : 1 << i;
    }
    gl_SampleMask[0] = color.a > 0.0 ? covered : 0;
    outColor = vec4(color.rgb, 0.0);
}
)";

const char kResolveFragment[] = R"(
layout(binding = 0) uniform sampler2DMS blended;
layout(location = 0) out vec4 outColor;

void main() {
    vec4 sum = vec4(0.0);
    for (int i = 0; i < SAMPLES; ++i) sum += texelFetch(blended, ivec2(gl_FragCoord.xy), i);
    if (sum.a == 0.0) discard;
    outColor = vec4(sum.rgb / float(SAMPLES), 1.0);
}
)";

}  // namespace tessera::shader_text
