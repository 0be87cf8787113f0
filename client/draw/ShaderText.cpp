#include "client/draw/ShaderText.h"

namespace tessera::shader_text {

const char kBlocks[] = R"(
struct Light {
    vec4 place;
    vec4 radiance;
    vec4 cone;
};
layout(std140, binding = 0) uniform FrameBlock {
    mat4 clip_T_eye;
    mat4 eye_T_clip;
    vec4 worldRow0, worldRow1, worldRow2;
    vec4 sky, ground;
    vec4 clipPerPixel;
    Light lights[16];
};
layout(std140, binding = 1) uniform ItemBlock {
    vec4 eyeRow0, eyeRow1, eyeRow2;
    vec4 normalRow0, normalRow1, normalRow2;
    vec4 baseColor;
    vec4 emissiveAndRoughness;
    vec4 metallicAndFaceted;
    uvec4 nodeAndMaterial;
};
)";

const char kMeshVertex[] = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 color;
layout(location = 3) in vec2 texcoord;

invariant gl_Position;
#ifndef NODE_IDS
out vec3 vNormal;
out vec4 vColor;
#ifdef POSITION
out vec3 vPosition;
#endif
#ifdef TEXTURED
out vec2 vTexcoord;
#endif
#endif

void main() {
    vec4 p = vec4(position, 1.0);
    vec3 eye = vec3(dot(eyeRow0, p), dot(eyeRow1, p), dot(eyeRow2, p));
    gl_Position = clip_T_eye * vec4(eye, 1.0);
#ifndef NODE_IDS
    vNormal = vec3(dot(normalRow0.xyz, normal), dot(normalRow1.xyz, normal), dot(normalRow2.xyz, normal));
    vColor = baseColor * color;
#ifdef POSITION
    vPosition = eye;
#endif
#ifdef TEXTURED
    vTexcoord = texcoord;
#endif
#endif
}
)";

// 26 bits of normal (octahedral map: Cigolle et al., "Survey of efficient representations for independent unit
// vectors", 2014), 24 of colour (its square root), 14 of material.
const char kSurfaceFragment[] = R"(
in vec3 vNormal;
in vec4 vColor;
#ifdef POSITION
in vec3 vPosition;
#endif
#ifdef TEXTURED
in vec2 vTexcoord;
layout(binding = 0) uniform sampler2D baseColorImage;
#endif
layout(location = 0) out uvec2 outSurface;

void main() {
#ifdef POSITION
    // By construction the face's normal points to the eye.
    vec3 n = cross(dFdx(vPosition), dFdy(vPosition));
#else
    vec3 n = gl_FrontFacing ? vNormal : -vNormal;
#endif
    // A normal of no length (degenerate triangles, zeros in a file) faces along the view.
    float size = abs(n.x) + abs(n.y) + abs(n.z);
    n = size > 1e-30 ? n / size : vec3(0.0, 0.0, 1.0);
    vec2 folded = (1.0 - abs(n.yx)) * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(n.xy, vec2(0.0)));
    vec2 oct = n.z >= 0.0 ? n.xy : folded;
    uvec2 octBits = uvec2(clamp(oct * 4095.0 + 4095.5, 0.0, 8191.0));
    vec3 color = vColor.rgb;
#ifdef TEXTURED
    color *= texture(baseColorImage, vTexcoord).rgb;
#endif
    uvec3 c = uvec3(sqrt(clamp(color, 0.0, 1.0)) * 255.0 + 0.5);
    uint material = nodeAndMaterial.z;
    outSurface = uvec2(octBits.x | (octBits.y << 13u) | ((material & 63u) << 26u),
                       c.r | (c.g << 8u) | (c.b << 16u) | ((material >> 6u) << 24u));
}
)";

// Metal-roughness as glTF 2.0 (appendix B) defines it: GGX distribution, Smith's visibility in Hammon's approximation
// (2017), Schlick's Fresnel term. A light of radiance 1 that falls straight onto a white surface gives 1: the factor pi
// is taken into the light. A software rasteriser has no jumps (lanes are masked, not skipped): so there are no
// branches.
const char kLighting[] = R"(
// Radiance from a direction in the world: sky, horizon and ground, and three lamps as in a photographer's studio, so that
// metal has something to reflect. A function of the direction alone; a rough surface sees it blurred.
vec3 environment(vec3 d, float roughness) {
    float blur = 0.06 + 0.94 * roughness;
    vec3 c = mix(ground.rgb, sky.rgb, smoothstep(-blur, blur, d.y));
    float horizon = d.y / (0.18 + 0.6 * roughness);
    c += 0.35 * sky.rgb / (1.0 + 4.0 * horizon * horizon);
    vec3 toLamps = vec3(d.y, dot(d, vec3(0.64, 0.48, 0.60)), dot(d, vec3(-0.80, 0.36, 0.48)));
    vec3 lamps = smoothstep(vec3(0.90, 0.93, 0.95) - 0.7 * blur, vec3(0.90, 0.93, 0.95) + 0.06 * blur, toLamps);
    return c + sky.rgb * dot(lamps, vec3(2.2, 3.0, 1.6)) / (1.0 + 5.0 * roughness * roughness);
}

// Integral of the specular lobe over a white environment (Karis 2014, "Physically based shading on mobile").
vec3 environmentFactor(vec3 f0, float roughness, float nv) {
    vec4 r = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    float a = min(r.x * r.x, exp2(-9.28 * nv)) * r.x + r.y;
    vec2 scaleAndBias = vec2(-1.04, 1.04) * a + r.zw;
    return f0 * scaleAndBias.x + scaleAndBias.y;
}

struct Lit {
    vec3 position, n, v, f0;
    float nv, alpha, alpha2;
    vec3 diffuse, specular;
};

// The cone of KHR_lights_punctual: squared, so that it fades without an edge.
float coneOf(Light light, vec3 position) {
    vec3 l = position - light.place.xyz;
    float t = clamp(dot(l, light.cone.xyz) * inversesqrt(max(dot(l, l), 1e-8)) + light.cone.w, 0.0, 1.0);
    return t * t;
}

void addLight(inout Lit lit, vec4 place, vec4 radiance) {
    vec3 l = place.xyz - lit.position * place.w;
    float d2 = max(dot(l, l), 1e-8);
    float invD = inversesqrt(d2);
    l *= invD;
    // Window of KHR_lights_punctual: the light is zero at its range. Of a directional light, place.w is 0.
    float x2 = d2 * radiance.w * radiance.w;
    float nl = clamp(dot(lit.n, l), 0.0, 1.0);
    float strength = nl * mix(1.0, invD * invD * max(1.0 - x2 * x2, 0.0), place.w);
    // With h = (l + v) / |l + v|: |l + v|^2 = 2 + 2 l.v, so n.h and h.v need no vector h.
    float lv = dot(l, lit.v);
    float invH = inversesqrt(max(2.0 + 2.0 * lv, 1e-6));
    float nh = min((nl + lit.nv) * invH, 1.0);
    float grazing = 1.0 - min((1.0 + lv) * invH, 1.0);
    float grazing2 = grazing * grazing;
    vec3 fresnel = lit.f0 + (1.0 - lit.f0) * (grazing2 * grazing2 * grazing);
    float q = nh * nh * (lit.alpha2 - 1.0) + 1.0;
    float lobe = 0.5 * lit.alpha2 / max(q * q * mix(2.0 * nl * lit.nv, nl + lit.nv, lit.alpha), 1e-6);
    vec3 arriving = radiance.rgb * strength;
    lit.diffuse += arriving * (1.0 - fresnel);
    lit.specular += arriving * min(lobe, 40.0) * fresnel;
}

/// Diffusely and specularly reflected radiance towards the eye, for a surface with a unit normal in eye space.
Lit light(vec3 position, vec3 n, vec3 base, float metallic, float roughness) {
    vec3 v = normalize(-position);
    float nvRaw = dot(n, v);
    float nv = max(nvRaw, 1e-3);
    vec3 f0 = mix(vec3(0.04), base, metallic);
    vec3 diffuse = mix(ground.rgb, sky.rgb, 0.5 + 0.5 * dot(n, worldRow1.xyz));
    vec3 r = 2.0 * nvRaw * n - v;
    vec3 rWorld = vec3(dot(worldRow0.xyz, r), dot(worldRow1.xyz, r), dot(worldRow2.xyz, r));
    vec3 specular = environmentFactor(f0, roughness, nv) * environment(rWorld, roughness);
    float alpha = roughness * roughness;
    Lit lit = Lit(position, n, v, f0, nv, alpha, alpha * alpha, diffuse, specular);
    FOR_EACH_LIGHT
    lit.diffuse *= base * (1.0 - metallic);
    return lit;
}

// Khronos PBR Neutral (2024) without its toe: the identity up to 0.8, so that colours stay what they are; highlights fade
// towards white.
vec3 toneMap(vec3 c) {
    float peak = max(max(c.r, c.g), c.b);
    float newPeak = 1.0 - 0.04 / max(peak - 0.6, 0.2);
    float whiter = 1.0 - 1.0 / (0.15 * (peak - newPeak) + 1.0);
    vec3 bright = mix(c * (newPeak / max(peak, 0.8)), vec3(newPeak), whiter);
    return peak <= 0.8 ? c : bright;
}

// sRGB's curve by square roots: a quarter of a step of 255 off at most, a third of the cost of pow.
vec3 encodeSrgb(vec3 c) {
    c = max(c, vec3(0.0));
    vec3 s1 = sqrt(c);
    vec3 s2 = sqrt(s1);
    vec3 s3 = sqrt(s2);
    vec3 curve = 0.662002687 * s1 + 0.684122060 * s2 - 0.323583601 * s3 - 0.0225411470 * c;
    return mix(curve, 12.92 * c, lessThanEqual(c, vec3(0.0031308)));
}
)";

const char kScreenVertex[] = R"(
void main() {
    vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    gl_Position = vec4(corner, 0.5, 1.0);
}
)";

const char kReadSurface[] = R"(
#if SAMPLES > 1
layout(binding = 0) uniform usampler2DMS surfaces;
#else
layout(binding = 0) uniform usampler2D surfaces;
#endif

vec3 normalOf(uint bits) {
    vec2 oct = (vec2(uvec2(bits, bits >> 13u) & 8191u) - 4095.0) / 4095.0;
    vec3 n = vec3(oct, 1.0 - abs(oct.x) - abs(oct.y));
    float fold = max(-n.z, 0.0);
    n.xy -= fold * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(n.xy, vec2(0.0)));
    return normalize(n);
}
vec3 colorOf(uint bits) {
    vec3 root = vec3(uvec3(bits, bits >> 8u, bits >> 16u) & 255u) / 255.0;
    return root * root;
}
uint materialOf(uvec2 surface) { return (surface.x >> 26u) | ((surface.y >> 24u) << 6u); }
// Samples of one material with about the same normal are one surface.
bool sameSurface(uint material, vec3 n, uint otherMaterial, vec3 otherN) {
    return otherMaterial == material && dot(otherN, n) > 0.85;
}
)";

const char kLightFragment[] = R"(
#if SAMPLES > 1
layout(binding = 1) uniform sampler2DMS depths;
#else
layout(binding = 1) uniform sampler2D depths;
#endif
layout(binding = 2) uniform samplerBuffer materials;
layout(location = 0) out vec4 outColor;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    uvec2 surface = texelFetch(surfaces, at, 0).xy;
    vec3 n = normalOf(surface.x);
    vec3 base = colorOf(surface.y);
    uint material = materialOf(surface);
    int sampleOf = 0;
    float share = 1.0;
#if SAMPLES > 1
    // One surface is lit once, with the means of its samples. What else there is in the pixel is lit, as one, in a second
    // pass over such pixels only.
    vec3 sumN = n, sumBase = base, restN = vec3(0.0), restBase = vec3(0.0);
    float count = 1.0, restCount = 0.0;
    uint restMaterial = material;
    int restSample = 0;
    for (int i = 1; i < SAMPLES; ++i) {
        uvec2 other = texelFetch(surfaces, at, i).xy;
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
    }
#ifdef REST
    float inverse = 1.0 / max(restCount, 1.0);
    n = normalize(restN + vec3(0.0, 0.0, 1e-6));
    base = restBase * inverse;
    material = restMaterial;
    sampleOf = restSample;
    share = restCount / float(SAMPLES);
#else
    n = normalize(sumN);
    base = sumBase / count;
    // Tells the second pass, by the depth test, where it has something to do.
    gl_FragDepth = restCount > 0.0 ? 1.0 : 0.0;
#endif
#endif
    float depth = texelFetch(depths, at, sampleOf).x;
    vec4 eye = eye_T_clip * vec4(gl_FragCoord.xy * clipPerPixel.xy - 1.0, depth, 1.0);
    vec4 emissiveAndRoughness = texelFetch(materials, int(2u * material));
    vec2 metallicAndLit = texelFetch(materials, int(2u * material + 1u)).xy;
    Lit lit = light(eye.xyz / eye.w, n, base, metallicAndLit.x, emissiveAndRoughness.w);
    vec3 c = emissiveAndRoughness.rgb + metallicAndLit.y * (lit.diffuse + lit.specular);
    outColor = vec4(encodeSrgb(toneMap(c)), share);
}
)";

const char kBlendFragment[] = R"(
in vec3 vNormal;
in vec4 vColor;
in vec3 vPosition;
#ifdef TEXTURED
in vec2 vTexcoord;
layout(binding = 0) uniform sampler2D baseColorImage;
#endif
layout(location = 0) out vec4 outColor;

void main() {
    vec3 faceNormal = cross(dFdx(vPosition), dFdy(vPosition));
    vec3 n = metallicAndFaceted.y > 0.5 ? faceNormal : (gl_FrontFacing ? vNormal : -vNormal);
    float length2 = dot(n, n);
    n = length2 > 1e-30 ? n * inversesqrt(length2) : normalize(-vPosition);
    vec4 base = vColor;
#ifdef TEXTURED
    base *= texture(baseColorImage, vTexcoord);
#endif
    Lit lit = light(vPosition, n, base.rgb, metallicAndFaceted.x, emissiveAndRoughness.w);
    // What is transparent shows its highlights all the same.
    float a = clamp(base.a, 0.0, 1.0);
    float shine = min(max(max(lit.specular.r, lit.specular.g), lit.specular.b), 1.0);
    float outAlpha = a + (1.0 - a) * shine;
    vec3 c = ((lit.diffuse + emissiveAndRoughness.rgb) * a + lit.specular) / max(outAlpha, 1e-3);
    outColor = vec4(encodeSrgb(toneMap(c)), outAlpha);
}
)";

const char kCopyFragment[] = R"(
layout(binding = 0) uniform sampler2D picture;
layout(location = 0) out vec4 outColor;
void main() { outColor = vec4(texelFetch(picture, ivec2(gl_FragCoord.xy), 0).rgb, 0.0); }
)";

const char kSpreadFragment[] = R"(
layout(binding = 1) uniform sampler2D rest;
layout(location = 0) out vec4 outColor;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 color = texelFetch(rest, at, 0);
    uvec2 first = texelFetch(surfaces, at, 0).xy;
    vec3 n = normalOf(first.x);
    int covered = 0;
    for (int i = 1; i < SAMPLES; ++i) {
        uvec2 other = texelFetch(surfaces, at, i).xy;
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

const char kNodeIdFragment[] = R"(
layout(location = 0) out uvec2 outNode;
void main() { outNode = nodeAndMaterial.xy; }
)";

}  // namespace tessera::shader_text
