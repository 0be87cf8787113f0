// What items are: their vertices, their surface, and the first pass that packs it.
#include "client/draw/shaders/ShaderText.h"

namespace tessera::shader_text {

const char kBlocks[] = R"(
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
)";

const char kItemInputs[] = R"(
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
)";

const char kMeshVertex[] = R"(
#ifdef NODE
flat out uvec2 vNode;
#endif
invariant gl_Position;
#ifdef SURFACE
// Where a triangle is seen: at a pixel's middle outside of it normals would turn away, and slivers at a silhouette be
// black. What all of a point has is the same for all its pixels; where on it one looks, its fragments find out.
#ifdef POINTS
#define OVER_SURFACE flat out
flat out vec3 vNormal;
#else
#define OVER_SURFACE out
centroid out vec3 vNormal;
#ifdef POSITION
#ifdef MARCHED
centroid out vec3 vPosition;
#else
out vec3 vPosition;
#endif
#endif
#ifdef LAYERS
out vec3 vItem;  // in the item's own coordinates
#endif
#ifdef PERSON
out vec3 vNodePosition;
#endif
#endif
#ifdef PLAIN
flat out uvec2 vMaterial;
#else
OVER_SURFACE vec4 vColor;
#endif
#ifdef MAPS
OVER_SURFACE vec4 vTexcoords;
flat out vec4 vPlace[10];  // as it is in the block: for a pixel numbers of a block are dear, see kPassedFrame
#endif
#endif

#ifdef STREAKS
#define WIDTH min(texcoord1.y, uintBitsToFloat(itemSize.y))
#else
#define WIDTH uintBitsToFloat(itemSize.x)
#endif
#if defined(LINES) || defined(STREAKS)
// A line is a strip of two triangles as wide as it is to be on the screen, with square ends. `normal` is its other end,
// the second texture coordinate says to which side: of the other end the other way round.
vec4 cornerOfLine(vec4 a) {
    vec4 p = vec4(normal, 1.0);
    vec4 b = clip_T_eye * vec4(dot(eyeRow0, p), dot(eyeRow1, p), dot(eyeRow2, p), 1.0);
    // Up to the near plane, where depth is 1: what lies behind the eye has no place on the screen.
    float beyondA = a.w - a.z, beyondB = b.w - b.z;
    if (beyondA < 0.0 && beyondB < 0.0) return a;
    // Each end by its share: a difference of the two would round the near one away where the other is very far.
    vec4 cut = a * (beyondB / (beyondB - beyondA)) - b * (beyondA / (beyondB - beyondA));
    if (beyondA < 0.0) a = cut;
    if (beyondB < 0.0) b = cut;
    vec2 along = b.xy / (b.w * clipPerPixel.xy) - a.xy / (a.w * clipPerPixel.xy);
    float size = length(along);
    along = size > 1e-6 ? along / size : vec2(1.0 - 2.0 * texcoord1.y, 0.0);
    vec2 aside = texcoord1.x * vec2(-along.y, along.x);
    a.xy += 0.5 * WIDTH * (aside - along) * clipPerPixel.xy * a.w;
#ifndef STREAKS
    // What is an outline lies before its surface; else exactly where it is.
    a.z *= 1.0 + uintBitsToFloat(itemSize.y);
#endif
    return a;
}
#endif

#ifdef SPRITES
// A square in the plane across the way to the head, upright in the world: so it is the same for both eyes and on all
// screens. texcoord1: the cosine and sine of its turn.
vec3 cornerOfSprite(vec3 middle) {
    vec3 towards = head.xyz - middle;
    float far = length(towards);
    towards = far > 1e-12 ? towards / far : vec3(0.0, 0.0, 1.0);
    vec3 aside = cross(worldRow1.xyz, towards);
    float size = length(aside);
    // Seen from right above or below.
    if (size < 1e-4) {
        aside = cross(worldRow2.xyz, towards);
        size = length(aside);
    }
    aside /= size;
    vec3 up = cross(towards, aside);
    vec2 turned = vec2(texcoord1.x * normal.x - texcoord1.y * normal.y,
                       texcoord1.y * normal.x + texcoord1.x * normal.y);
    return middle + 0.5 * texcoord.x * uintBitsToFloat(itemSize.x) * (turned.x * aside + turned.y * up);
}
#endif

void main() {
#ifdef POINTS
    fetchPoint();
#endif
#ifdef MOVED
    // A person's program: no farther than it says, as boxes know that alone.
    uv = texcoord;
    uv1 = texcoord1;
    vec3 movedPosition = position, movedNormal = normal;
    vertex(movedPosition, movedNormal);
    vec3 moved = movedPosition - position;
    float way = length(moved);
    // Of what is no number nothing is moved.
    movedPosition = position + (way <= tesseraReach ? moved : way < 1e30 ? moved * (tesseraReach / way) : vec3(0.0));
    movedNormal = dot(movedNormal, movedNormal) < 1e30 ? movedNormal : normal;
#define position movedPosition
#define normal movedNormal
#endif
    vec4 p = vec4(position, 1.0);
    vec3 eye = vec3(dot(eyeRow0, p), dot(eyeRow1, p), dot(eyeRow2, p));
#ifdef DISCS
    eye.xy += 0.5 * texcoord.x * uintBitsToFloat(itemSize.x) * normal.xy;
#endif
#ifdef SPRITES
    eye = cornerOfSprite(eye);
#endif
#ifdef POINTS
    gl_Position = aroundBall(eye);
#else
    gl_Position = clip_T_eye * vec4(eye, 1.0);
#endif
#if defined(LINES) || defined(STREAKS)
    gl_Position = cornerOfLine(gl_Position);
#endif
#ifdef ROWS
    vRow0 = normalRow0.xyz;
    vRow1 = normalRow1.xyz;
    vRow2 = normalRow2.xyz;
#endif
#ifdef NODE
    vNode = node;
#endif
#ifdef SURFACE
#if defined(DISCS) || defined(SPRITES)
    vNormal = vec3(0.0, 0.0, 1.0);
#else
    vNormal = vec3(dot(normalRow0.xyz, normal), dot(normalRow1.xyz, normal), dot(normalRow2.xyz, normal));
#endif
#ifdef PLAIN
    vMaterial = look.material.yz;
#if defined(POINTS) && (POINTS & 1) != 0
    // All of a point is of one colour.
    uvec3 c = uvec3(sqrt(clamp(look.baseColor.rgb * color.rgb, 0.0, 1.0)) * 255.0 + 0.5);
    vMaterial.y = (vMaterial.y & 0xff000000u) | c.r | (c.g << 8u) | (c.b << 16u);
#endif
#if defined(POINTS) && (POINTS & 2) != 0
    vMaterial.x |= packedNormal(vNormal);
#endif
#else
    vColor = look.baseColor * color;
#endif
#ifdef POINTS
#ifdef IN_ITEM
    vPoint = vec4(position, uintBitsToFloat((POINTS & 8) != 0 ? itemSize.x : itemSize.y));
#endif
#else
#ifdef POSITION
    vPosition = eye;
#endif
#ifdef LAYERS
    vItem = position;
#endif
#ifdef PERSON
    vNodePosition = position;
#endif
#endif
#ifdef MAPS
    vPlace = look.place;
#if defined(DISCS) || defined(SPRITES)
    vTexcoords = 0.5 + 0.5 * vec4(normal.x, -normal.y, normal.x, -normal.y);
#elif defined(STREAKS)
    vTexcoords = vec4(0.5);
#elif defined(LINES)
    vTexcoords = texcoord.xyxy;
#else
    vTexcoords = vec4(texcoord, texcoord1);
#endif
#endif
#endif
}
)";

const char kSurfaceStruct[] = R"(
struct Surface {
    vec3 normal;  // as long as it comes
    vec4 base;
    float metallic, roughness, occlusion;
    vec3 emissive;
};
)";

const char kSurface[] = R"(
#ifdef POINTS
#define OVER_SURFACE flat in
flat in vec3 vNormal;
#define vItem ballItem
#define vNodePosition ballItem
#else
#define OVER_SURFACE in
centroid in vec3 vNormal;
#ifdef POSITION
in vec3 vPosition;
#endif
#ifdef LAYERS
in vec3 vItem;
#endif
#ifdef PERSON
in vec3 vNodePosition;
#endif
#endif
#ifdef PLAIN
flat in uvec2 vMaterial;
const vec4 vColor = vec4(1.0);
#else
OVER_SURFACE vec4 vColor;
#endif
#ifdef MAPS
OVER_SURFACE vec4 vTexcoords;
flat in vec4 vPlace[10];
layout(binding = 3) uniform sampler2D baseColorImage;
layout(binding = 4) uniform sampler2D metallicRoughnessImage;
layout(binding = 5) uniform sampler2D normalImage;
layout(binding = 6) uniform sampler2D occlusionImage;
layout(binding = 7) uniform sampler2D emissiveImage;

vec2 placed(int map) {
    vec3 uv = vec3(vPlace[2 * map].w > 0.5 ? vTexcoords.zw : vTexcoords.xy, 1.0);
    return vec2(dot(vPlace[2 * map].xyz, uv), dot(vPlace[2 * map + 1].xyz, uv));
}
#endif

#ifdef PERSON
// What is no number would be another colour in each driver.
vec4 sound(vec4 v) { return mix(clamp(v, vec4(-1e6), vec4(1e6)), vec4(0.0), isnan(v)); }
void changeByPerson(inout Surface s) {
    uv = vTexcoords.xy;
    uv1 = vTexcoords.zw;
    nodePosition = vNodePosition;
    eyePosition = vPosition;
    vec4 eye = vec4(vPosition, 1.0);
    worldPosition = vec3(dot(placeRow0, eye), dot(placeRow1, eye), dot(placeRow2, eye));
    surface(s);
    s.normal = sound(vec4(s.normal, 0.0)).xyz;
    s.base = max(sound(s.base), vec4(0.0));
    vec4 rest = clamp(sound(vec4(s.metallic, s.roughness, s.occlusion, 0.0)), vec4(0.0), vec4(1.0));
    s.metallic = rest.x;
    s.roughness = max(rest.y, 0.045);
    s.occlusion = rest.z;
    s.emissive = max(sound(vec4(s.emissive, 0.0)).rgb, vec3(0.0));
}
#endif

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
    m.xy *= look.strengths.x;
    return t * m.x + b * m.y + n * m.z;
}
#endif

#ifdef LAYERS
// Texture layers: where each looks into its image, for a unit normal in eye space. Which of these it is, is the
// program's.
#ifdef LAYER0_SAMPLER
layout(binding = 16) uniform LAYER0_SAMPLER layerImage0;
#endif
#ifdef LAYER1_SAMPLER
layout(binding = 17) uniform LAYER1_SAMPLER layerImage1;
#endif
#ifdef LAYER2_SAMPLER
layout(binding = 18) uniform LAYER2_SAMPLER layerImage2;
#endif
#ifdef LAYER3_SAMPLER
layout(binding = 19) uniform LAYER3_SAMPLER layerImage3;
#endif

vec2 laid(int layer, vec2 uv) {
    vec3 at = vec3(uv, 1.0);
    return vec2(dot(look.layerPlace[2 * layer].xyz, at), dot(look.layerPlace[2 * layer + 1].xyz, at));
}
vec2 byTexcoords(int layer, vec3 n) {
    return laid(layer, look.layerPlace[2 * layer].w > 0.5 ? vTexcoords.zw : vTexcoords.xy);
}
// A sphere map: the image's middle is what faces the eye. Up is the world's, so that all screens of a room show the
// same.
vec2 bySphere(int layer, vec3 n) {
    vec3 v = normalize(-vPosition), up = normalize(placeRow1.xyz);
    vec3 right = cross(up, v);
    right = dot(right, right) > 1e-10 ? normalize(right) : vec3(1.0, 0.0, 0.0);
    return vec2(0.5 + 0.5 * dot(n, right), 0.5 - 0.5 * dot(n, cross(v, right)));
}
vec3 byReflection(int layer, vec3 n) {
    vec3 r = reflect(normalize(vPosition), n);
    return vec3(dot(normalize(placeRow0.xyz), r), dot(normalize(placeRow1.xyz), r), dot(normalize(placeRow2.xyz), r));
}
// As an Environment's image lies: its middle is -Z. Where its sides meet, the coordinate that does not leap says how
// far its neighbours are (Tarini 2012, "Cylindrical and toroidal parameterizations without vertex seams").
vec2 allAround(int layer, vec3 n) {
    vec3 d = byReflection(layer, n);
    float u = 0.5 + atan(d.x, -d.z) * (0.5 / 3.14159265), other = fract(u + 0.5) - 0.5;
    return vec2(fwidthCoarse(u) <= fwidthCoarse(other) + 1e-6 ? u : other,
                acos(clamp(d.y, -1.0, 1.0)) * (1.0 / 3.14159265));
}
// Pictures stand upright: their rows go down.
vec2 byPosition(int layer, vec3 n) { return laid(layer, vec2(vItem.x, -vItem.y)); }
vec3 fromOrigin(int layer, vec3 n) { return vItem; }
vec3 inSolid(int layer, vec3 n) { return vec3(laid(layer, vItem.xy), vItem.z); }

// TextureLayer.h's modes, in their order. What is covered stays so: alpha is the base colour's.
void addLayer(inout Surface s, int layer, vec4 t) {
    vec4 how = look.layers[layer];
    vec3 c = s.base.rgb;
    vec3 made = how.x < 0.5 ? c * t.rgb : how.x < 1.5 ? c + t.rgb : how.x < 2.5 ? mix(c, t.rgb, t.a) : t.rgb;
    s.base.rgb = mix(c, made, how.y);
}

void addLayers(inout Surface s) {
    float size2 = dot(s.normal, s.normal);
    vec3 n = size2 > 1e-30 ? s.normal * inversesqrt(size2) : normalize(-vPosition);
#ifdef LAYER0_SAMPLER
    addLayer(s, 0, texture(layerImage0, LAYER0_PLACE(0, n)));
#endif
#ifdef LAYER1_SAMPLER
    addLayer(s, 1, texture(layerImage1, LAYER1_PLACE(1, n)));
#endif
#ifdef LAYER2_SAMPLER
    addLayer(s, 2, texture(layerImage2, LAYER2_PLACE(2, n)));
#endif
#ifdef LAYER3_SAMPLER
    addLayer(s, 3, texture(layerImage3, LAYER3_PLACE(3, n)));
#endif
}
#endif

// What the material and its images say of this pixel.
Surface surface() {
    Surface s;
#ifdef POINTS
    float facing = vBall.w < 0.0 ? -1.0 : 1.0;
#else
    float facing = gl_FrontFacing ? 1.0 : -1.0;
#endif
#if defined(POINTS) && (POINTS & 2) == 0
    s.normal = facing * ballNormal;
#elif defined(FACETED)
    // By construction the face's normal points to the eye.
    s.normal = cross(dFdx(vPosition), dFdy(vPosition));
#else
    s.normal = facing * vNormal;
#endif
    s.base = vColor;
#if defined(DISCS) && defined(MAPS)
    float fromMiddle = length(2.0 * vTexcoords.xy - 1.0);
    s.base.a *= clamp((1.0 - fromMiddle) / max(fwidth(fromMiddle), 1e-6) + 0.5, 0.0, 1.0);
#endif
    s.metallic = look.metallic.x;
    s.roughness = look.emissiveAndRoughness.w;
    s.occlusion = 1.0;
    s.emissive = look.emissiveAndRoughness.rgb;
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
    s.occlusion = 1.0 + look.strengths.y * (texture(occlusionImage, placed(3)).r - 1.0);
#endif
#if (MAPS & 16) != 0
    s.emissive *= texture(emissiveImage, placed(4)).rgb;
#endif
#endif
#ifdef LAYERS
    addLayers(s);
#endif
#ifdef PERSON
    changeByPerson(s);
#endif
    return s;
}
#ifdef MASKED
// What is as opaque as the cutoff is there; less than a step of an image's alpha is rounding.
float aboveCutoff(Surface s) { return s.base.a - look.strengths.z + 1e-4; }
#endif
)";

// What the first pass packs: 26 bits of normal (octahedral map: Cigolle et al., "Survey of efficient representations
// for independent unit vectors", 2014), 24 of colour (its square root), 14 of material. What images alone can say goes
// into 64 more: emitted light with a common exponent of its three colours, a byte each of metal, roughness and
// occlusion.
const char kPackNormal[] = R"(
uint packedNormal(vec3 n) {
    // A normal of no length (degenerate triangles, zeros in a file) faces along the view.
    float size = abs(n.x) + abs(n.y) + abs(n.z);
    n = size > 1e-30 ? n * (1.0 / size) : vec3(0.0, 0.0, 1.0);
    vec2 folded = (1.0 - abs(n.yx)) * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(n.xy, vec2(0.0)));
    vec2 oct = n.z >= 0.0 ? n.xy : folded;
    uvec2 octBits = uvec2(clamp(oct * 4095.0 + 4095.5, 0.0, 8191.0));
    return octBits.x | (octBits.y << 13u);
}
)";

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
#ifdef POINTS
    meetBall();
#endif
    Surface s = surface();
#if !defined(PLAIN) || !defined(POINTS) || (POINTS & 2) == 0
    uint normalBits = packedNormal(s.normal);
#else
    const uint normalBits = 0u;  // the point's is in its material
#endif
#ifdef PLAIN
    outSurface = uvec2(normalBits | vMaterial.x, vMaterial.y);
#else
    uvec3 c = uvec3(sqrt(clamp(s.base.rgb, 0.0, 1.0)) * 255.0 + 0.5);
    uint material = look.material.x;
    outSurface = uvec2(normalBits | ((material & 63u) << 26u),
                       c.r | (c.g << 8u) | (c.b << 16u) | ((material >> 6u) << 24u));
#endif
#ifdef DETAIL
    outDetail = uvec2(0u);
#if defined(PERSON) || (defined(MAPS) && (MAPS & 26) != 0)
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

const char kNodeIdFragment[] = R"(
flat in uvec2 vNode;
layout(location = 0) out uvec2 outNode;
void main() {
#ifdef POINTS
    meetBall();
#endif
#if defined(MASKED)
    if (aboveCutoff(surface()) < 0.0) discard;
#elif defined(PERSON)
    surface();
#endif
    outNode = vNode;
}
)";

const char kShadowFragment[] = R"(
void main() {
#ifdef POINTS
    meetBall();
#endif
#if defined(MASKED)
    if (aboveCutoff(surface()) < 0.0) discard;
#elif defined(PERSON)
    surface();
#endif
}
)";

}  // namespace tessera::shader_text
