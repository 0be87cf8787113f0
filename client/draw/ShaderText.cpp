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
#ifdef MAPS
layout(std140, binding = 2) uniform LookBlock {
    // Of each map: two rows that place it (u = row0.xyz * (u, v, 1)), and in row0.w which texture coordinates it takes.
    vec4 place[10];
    vec4 strengths;  // of normals, of occlusion; alpha's cutoff
    vec4 effects;    // transmission, 1 for unlit, lacquer and its roughness
};
#endif
)";

const char kMeshVertex[] = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 color;
layout(location = 3) in vec2 texcoord;
layout(location = 4) in vec2 texcoord1;

invariant gl_Position;
#ifdef SURFACE
out vec3 vNormal;
out vec4 vColor;
#ifdef POSITION
out vec3 vPosition;
#endif
#ifdef MAPS
out vec4 vTexcoords;
#endif
#endif

#ifdef LINES
// A line is a strip of two triangles as wide as it is to be on the screen, with square ends. `normal` is its other end, the
// second texture coordinate says to which side: of the other end the other way round.
vec4 cornerOfLine(vec4 a) {
    vec4 p = vec4(normal, 1.0);
    vec4 b = clip_T_eye * vec4(dot(eyeRow0, p), dot(eyeRow1, p), dot(eyeRow2, p), 1.0);
    // Up to the near plane, where depth is 1: what lies behind the eye has no place on the screen.
    float beyondA = a.w - a.z, beyondB = b.w - b.z;
    if (beyondA < 0.0 && beyondB < 0.0) return a;
    vec4 cut = a + (b - a) * (beyondA / (beyondA - beyondB));
    if (beyondA < 0.0) a = cut;
    if (beyondB < 0.0) b = cut;
    vec2 along = b.xy / (b.w * clipPerPixel.xy) - a.xy / (a.w * clipPerPixel.xy);
    float size = length(along);
    along = size > 1e-6 ? along / size : vec2(1.0, 0.0);
    vec2 aside = texcoord1.x * vec2(-along.y, along.x);
    a.xy += 0.5 * metallicAndFaceted.z * (aside - along) * clipPerPixel.xy * a.w;
    return a;
}
#endif

void main() {
    vec4 p = vec4(position, 1.0);
    vec3 eye = vec3(dot(eyeRow0, p), dot(eyeRow1, p), dot(eyeRow2, p));
    gl_Position = clip_T_eye * vec4(eye, 1.0);
#ifdef LINES
    gl_Position = cornerOfLine(gl_Position);
#endif
#ifdef SURFACE
    vNormal = vec3(dot(normalRow0.xyz, normal), dot(normalRow1.xyz, normal), dot(normalRow2.xyz, normal));
    vColor = baseColor * color;
#ifdef POSITION
    vPosition = eye;
#endif
#ifdef MAPS
#ifdef LINES
    vTexcoords = texcoord.xyxy;
#else
    vTexcoords = vec4(texcoord, texcoord1);
#endif
#endif
#endif
}
)";

const char kSurface[] = R"(
in vec3 vNormal;
in vec4 vColor;
#ifdef POSITION
in vec3 vPosition;
#endif
#ifdef MAPS
in vec4 vTexcoords;
layout(binding = 3) uniform sampler2D baseColorImage;
layout(binding = 4) uniform sampler2D metallicRoughnessImage;
layout(binding = 5) uniform sampler2D normalImage;
layout(binding = 6) uniform sampler2D occlusionImage;
layout(binding = 7) uniform sampler2D emissiveImage;

vec2 placed(int map) {
    vec3 uv = vec3(place[2 * map].w > 0.5 ? vTexcoords.zw : vTexcoords.xy, 1.0);
    return vec2(dot(place[2 * map].xyz, uv), dot(place[2 * map + 1].xyz, uv));
}
#endif

struct Surface {
    vec3 normal;  // as long as it comes
    vec4 base;
    float metallic, roughness, occlusion;
    vec3 emissive;
};

#if defined(MAPS) && (MAPS & 4) != 0
// Tangents from how position and texture coordinates change over the screen (Schueler 2013, "Followup: normal mapping
// without precomputed tangents"), made orthogonal as glTF's own frame is: green points against v.
vec3 mappedNormal(vec3 n, float facing) {
    vec2 uv = placed(2);
    vec3 p1 = dFdx(vPosition), p2 = dFdy(vPosition);
    vec2 t1 = dFdx(uv), t2 = dFdy(uv);
    vec3 across2 = cross(p2, n), across1 = cross(n, p1);
    // On a face seen from behind the screen's axes are mirrored against it, which turns both around.
    vec3 alongU = facing * (across2 * t1.x + across1 * t2.x), alongV = facing * (across2 * t1.y + across1 * t2.y);
    float length2 = dot(alongU, alongU);
    // Without texture coordinates there is no frame.
    if (!(length2 > 1e-36)) return n;
    vec3 t = alongU * inversesqrt(length2);
    vec3 b = cross(n, t);
    b *= dot(b, alongV) > 0.0 ? -1.0 : 1.0;
    vec3 m = texture(normalImage, uv).xyz * 2.0 - 1.0;
    m.xy *= strengths.x;
    return t * m.x + b * m.y + n * m.z;
}
#endif

// What the material and its images say of this pixel.
Surface surface() {
    Surface s;
    float facing = gl_FrontFacing ? 1.0 : -1.0;
#ifdef FACETED
    // By construction the face's normal points to the eye.
    s.normal = cross(dFdx(vPosition), dFdy(vPosition));
#else
    s.normal = facing * vNormal;
#endif
    s.base = vColor;
    s.metallic = metallicAndFaceted.x;
    s.roughness = emissiveAndRoughness.w;
    s.occlusion = 1.0;
    s.emissive = emissiveAndRoughness.rgb;
#ifdef MAPS
#if (MAPS & 1) != 0
    s.base *= texture(baseColorImage, placed(0));
#endif
#if (MAPS & 2) != 0
    vec4 metallicRoughness = texture(metallicRoughnessImage, placed(1));
    s.metallic *= metallicRoughness.b;
    s.roughness = max(s.roughness * metallicRoughness.g, 0.045);
#endif
#if (MAPS & 4) != 0
    float size2 = dot(s.normal, s.normal);
    if (size2 > 1e-30) s.normal = facing * mappedNormal(facing * s.normal * inversesqrt(size2), facing);
#endif
#if (MAPS & 8) != 0
    s.occlusion = 1.0 + strengths.y * (texture(occlusionImage, placed(3)).r - 1.0);
#endif
#if (MAPS & 16) != 0
    s.emissive *= texture(emissiveImage, placed(4)).rgb;
#endif
#endif
    return s;
}
#ifdef MASKED
// What is as opaque as the cutoff is there; less than a step of an image's alpha is rounding.
float aboveCutoff(Surface s) { return s.base.a - strengths.z + 1e-4; }
#endif
)";

// 26 bits of normal (octahedral map: Cigolle et al., "Survey of efficient representations for independent unit
// vectors", 2014), 24 of colour (its square root), 14 of material. What images alone can say goes into 64 more:
// emitted light with a common exponent of its three colours, a byte each of metal, roughness and occlusion.
const char kPackFragment[] = R"(
layout(location = 0) out uvec2 outSurface;
#ifdef DETAIL
layout(location = 1) out uvec2 outDetail;
// As GL_RGB9_E5 (OpenGL 4.5, 8.5.2).
uint sharedExponent(vec3 c) {
    c = clamp(c, 0.0, 65408.0);
    float largest = max(max(c.r, c.g), max(c.b, 1e-9));
    int e = max(-16, int(floor(log2(largest)))) + 16;
    if (floor(largest * exp2(float(24 - e)) + 0.5) > 511.0) ++e;
    uvec3 m = uvec3(c * exp2(float(24 - e)) + 0.5);
    return m.r | (m.g << 9u) | (m.b << 18u) | (uint(e) << 27u);
}
#endif

void main() {
    Surface s = surface();
    vec3 n = s.normal;
    // A normal of no length (degenerate triangles, zeros in a file) faces along the view.
    float size = abs(n.x) + abs(n.y) + abs(n.z);
    n = size > 1e-30 ? n / size : vec3(0.0, 0.0, 1.0);
    vec2 folded = (1.0 - abs(n.yx)) * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(n.xy, vec2(0.0)));
    vec2 oct = n.z >= 0.0 ? n.xy : folded;
    uvec2 octBits = uvec2(clamp(oct * 4095.0 + 4095.5, 0.0, 8191.0));
    uvec3 c = uvec3(sqrt(clamp(s.base.rgb, 0.0, 1.0)) * 255.0 + 0.5);
    uint material = nodeAndMaterial.z;
    outSurface = uvec2(octBits.x | (octBits.y << 13u) | ((material & 63u) << 26u),
                       c.r | (c.g << 8u) | (c.b << 16u) | ((material >> 6u) << 24u));
#ifdef DETAIL
    outDetail = uvec2(0u);
#if defined(MAPS) && (MAPS & 26) != 0
    uvec3 bytes = uvec3(clamp(vec3(s.metallic, s.roughness, s.occlusion), 0.0, 1.0) * 255.0 + 0.5);
    outDetail = uvec2(sharedExponent(s.emissive), bytes.x | (bytes.y << 8u) | (bytes.z << 16u) | 0x80000000u);
#endif
#endif
#ifdef MASKED
    float above = aboveCutoff(s);
#if SAMPLES > 1
    // As many samples as the share of the pixel above the cutoff, were alpha a straight slope: an edge without steps.
    float slope = fwidth(s.base.a);
    float share = slope > 1e-4 ? clamp(above / slope + 0.5, 0.0, 1.0) : step(0.0, above);
    int covered = int(share * float(SAMPLES) + 0.5);
    if (covered == 0) discard;
    // Samples that lie across from each other first.
    gl_SampleMask[0] = covered == 1 ? 1 : covered == 2 ? 9 : covered == 3 ? 11 : 15;
#else
    if (above < 0.0) discard;
#endif
#endif
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
#ifdef COATED
    float coatAlpha, coatAlpha2;
    vec3 coat;  // what a whole layer of lacquer reflects
#endif
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
#ifdef COATED
    q = nh * nh * (lit.coatAlpha2 - 1.0) + 1.0;
    lobe = 0.5 * lit.coatAlpha2 / max(q * q * mix(2.0 * nl * lit.nv, nl + lit.nv, lit.coatAlpha), 1e-6);
    lit.coat += arriving * min(lobe, 40.0) * (0.04 + 0.96 * grazing2 * grazing2 * grazing);
#endif
}

/// Diffusely and specularly reflected radiance towards the eye, for a surface with a unit normal in eye space.
/// `occlusion`: the share of the surroundings' light that arrives. `coat`: of lacquer over it (KHR_materials_clearcoat), and
/// its roughness.
Lit light(vec3 position, vec3 n, vec3 base, float metallic, float roughness, float occlusion, vec2 coat) {
    vec3 v = normalize(-position);
    float nvRaw = dot(n, v);
    float nv = max(nvRaw, 1e-3);
    vec3 f0 = mix(vec3(0.04), base, metallic);
    vec3 diffuse = occlusion * mix(ground.rgb, sky.rgb, 0.5 + 0.5 * dot(n, worldRow1.xyz));
    vec3 r = 2.0 * nvRaw * n - v;
    vec3 rWorld = vec3(dot(worldRow0.xyz, r), dot(worldRow1.xyz, r), dot(worldRow2.xyz, r));
    vec3 specular = occlusion * environmentFactor(f0, roughness, nv) * environment(rWorld, roughness);
    float alpha = roughness * roughness;
    Lit lit;
    lit.position = position;
    lit.n = n;
    lit.v = v;
    lit.f0 = f0;
    lit.nv = nv;
    lit.alpha = alpha;
    lit.alpha2 = alpha * alpha;
    lit.diffuse = diffuse;
    lit.specular = specular;
#ifdef COATED
    float coatRoughness = max(coat.y, 0.045);
    lit.coatAlpha = coatRoughness * coatRoughness;
    lit.coatAlpha2 = lit.coatAlpha * lit.coatAlpha;
    lit.coat = occlusion * environmentFactor(vec3(0.04), coatRoughness, nv) * environment(rWorld, coatRoughness);
#endif
    FOR_EACH_LIGHT
    lit.diffuse *= base * (1.0 - metallic);
#ifdef COATED
    // What the lacquer reflects towards the eye does not come from below it.
    float grazing = 1.0 - nv;
    float grazing2 = grazing * grazing;
    float below = 1.0 - coat.x * (0.04 + 0.96 * grazing2 * grazing2 * grazing);
    lit.diffuse *= below;
    lit.specular = lit.specular * below + coat.x * lit.coat;
#endif
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
#ifdef BACKGROUND
layout(binding = 2) uniform samplerBuffer materials;
flat out vec3 background;
#endif
void main() {
#ifdef BACKGROUND
    background = encodeSrgb(toneMap(texelFetch(materials, 0).rgb));
#endif
    vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    gl_Position = vec4(corner, SCREEN_DEPTH, 1.0);
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
#ifdef DETAIL
#if SAMPLES > 1
layout(binding = 8) uniform usampler2DMS details;
#else
layout(binding = 8) uniform usampler2D details;
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
// sixteen pixels with which a pass has nothing to do. The background is finished here. 0.5: all samples show the same;
// 0.75: one surface, its normal or colour differs; 1: may be several, see sameSurface.
const char kClassifyFragment[] = R"(
flat in vec3 background;
layout(location = 0) out vec4 outColor;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    uvec2 first = texelFetch(surfaces, at, 0).xy;
    uvec2 all = first, differ = uvec2(0u);
    bvec2 apart = bvec2(false);
#if SAMPLES > 1
    uvec2 oct = uvec2(first.x, first.x >> 13u) & 8191u;
#ifdef DETAIL
    uvec2 detail = texelFetch(details, at, 0).xy;
#endif
    for (int i = 1; i < SAMPLES; ++i) {
        uvec2 other = texelFetch(surfaces, at, i).xy;
        uvec2 bits = other ^ first;
        all |= other;
        differ |= bits;
#ifdef DETAIL
        differ |= texelFetch(details, at, i).xy ^ detail;
#endif
        // A twentieth of the octahedron's map is at most 15 degrees.
        uvec2 otherOct = uvec2(other.x, other.x >> 13u) & 8191u;
        apart = bvec2(uvec2(apart) | uvec2(greaterThan(max(oct, otherOct) - min(oct, otherOct), uvec2(400u))) |
                      uvec2(bits.x >> 26u, bits.y >> 24u));
    }
#endif
    float work = (differ.x | differ.y) == 0u ? 0.5 : any(apart) ? 1.0 : 0.75;
    // What has to be gone through anyway takes its neighbours along.
    float mixed = work > 0.5 ? 1.0 : 0.0;
    mixed += abs(dFdxFine(mixed));
    mixed += abs(dFdyFine(mixed));
    work = mixed > 0.0 ? max(work, 0.75) : work;
    gl_FragDepth = (all.x | all.y) == 0u ? 0.0 : work;
    outColor = vec4(background, 1.0);
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
#ifdef DETAIL
    uvec2 detail = texelFetch(details, at, 0).xy;
    vec3 emitted = emissiveOf(detail.x), bytes = bytesOf(detail.y);
#endif
#if SAMPLES > 1 && !defined(ONE_SURFACE)
    // One surface is lit once, with the means of its samples. What else there is in the pixel is lit, as one, in a second
    // pass over such pixels only.
    vec3 sumN = n, sumBase = base, restN = vec3(0.0), restBase = vec3(0.0);
    float count = 1.0, restCount = 0.0;
    uint restMaterial = material;
    int restSample = 0;
#ifdef DETAIL
    vec3 sumEmitted = emitted, sumBytes = bytes, restEmitted = vec3(0.0), restBytes = vec3(0.0);
    uint restDetail = 0u;
#endif
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
#ifdef DETAIL
        uvec2 otherDetail = texelFetch(details, at, i).xy;
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
    float depth = texelFetch(depths, at, sampleOf).x;
    vec4 eye = eye_T_clip * vec4(gl_FragCoord.xy * clipPerPixel.xy - 1.0, depth, 1.0);
    vec4 emissiveAndRoughness = texelFetch(materials, int(2u * material));
    vec4 metallicLitAndCoat = texelFetch(materials, int(2u * material + 1u));
    float occlusion = 1.0;
#ifdef DETAIL
    bool detailed = (detail.y & 0x80000000u) != 0u;
    emissiveAndRoughness = detailed ? vec4(emitted, max(bytes.y, 0.045)) : emissiveAndRoughness;
    metallicLitAndCoat.x = detailed ? bytes.x : metallicLitAndCoat.x;
    occlusion = detailed ? bytes.z : 1.0;
#endif
    Lit lit = light(eye.xyz / eye.w, n, base, metallicLitAndCoat.x, emissiveAndRoughness.w, occlusion,
                    metallicLitAndCoat.zw);
    // 1: light falls on it; 0: the background; -1: its colour is what is seen.
    float litness = metallicLitAndCoat.y;
    vec3 c = emissiveAndRoughness.rgb + max(litness, 0.0) * (lit.diffuse + lit.specular);
    c = litness < 0.0 ? base : toneMap(c);
    outColor = vec4(encodeSrgb(c), share);
}
)";

const char kBlendFragment[] = R"(
layout(location = 0) out vec4 outColor;

void main() {
    Surface s = surface();
    vec3 n = s.normal;
    float length2 = dot(n, n);
    n = length2 > 1e-30 ? n * inversesqrt(length2) : normalize(-vPosition);
    vec2 coat = vec2(0.0);
    float through = 0.0, unlit = 0.0;
#ifdef MAPS
    through = effects.x * (1.0 - s.metallic);
    unlit = effects.y;
    coat = effects.zw;
#endif
    Lit lit = light(vPosition, n, s.base.rgb, s.metallic, s.roughness, s.occlusion, coat);
    // What light goes through takes the colour of what is behind it, as far as it has one of its own not.
    float a = clamp(s.base.a, 0.0, 1.0) * (1.0 - through * max(max(s.base.r, s.base.g), s.base.b));
    // What is transparent shows its highlights all the same.
    float shine = min(max(max(lit.specular.r, lit.specular.g), lit.specular.b), 1.0) * (1.0 - unlit);
    float outAlpha = a + (1.0 - a) * shine;
    vec3 c = ((lit.diffuse * (1.0 - through) + s.emissive) * a + lit.specular) / max(outAlpha, 1e-3);
    c = unlit > 0.5 ? s.base.rgb : toneMap(c);
    outColor = vec4(encodeSrgb(c), outAlpha);
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
void main() {
#ifdef MASKED
    if (aboveCutoff(surface()) < 0.0) discard;
#endif
    outNode = nodeAndMaterial.xy;
}
)";

}  // namespace tessera::shader_text
