// What a material and its images say of a pixel.

#ifdef POINTS
#define OVER_SURFACE flat in
flat in vec3 vNormal;
#define vItem ballItem
#define vNodePosition ballItem
#else
#define OVER_SURFACE in
centroid in vec3 vNormal;
#ifdef TANGENTS
centroid in vec4 vTangent;
#endif
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

#ifdef TANGENTS
// A tangent has no length where the mesh gives no direction. Nothing is made orthogonal again: whoever baked the image
// has not.
vec3 mappedNormal() {
    vec3 m = texture(normalImage, placed(2)).xyz * 2.0 - 1.0;
    m.xy *= look.strengths.x;
    return vTangent.xyz * m.x + vTangent.w * cross(vNormal, vTangent.xyz) * m.y + vNormal * m.z;
}
#elif defined(MAPS) && (MAPS & MAP_NORMAL) != 0
// Of what has no tangents of its own: from how position and texture coordinates change over the screen (Schueler 2013,
// "Followup: normal mapping without precomputed tangents"), made orthogonal as glTF has it: green points against v.
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
#if defined(POINTS) && (POINTS & POINT_NORMALS) == 0
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
#if (MAPS & MAP_BASE_COLOR) != 0
    s.base *= texture(baseColorImage, placed(0));
#endif
#if (MAPS & MAP_METALLIC_ROUGHNESS) != 0
    vec4 metallicRoughness = texture(metallicRoughnessImage, placed(1));
    s.metallic *= metallicRoughness.b;
    s.roughness = max(s.roughness * metallicRoughness.g, 0.045);
#endif
#ifdef TANGENTS
    s.normal = facing * mappedNormal();
#elif (MAPS & MAP_NORMAL) != 0
    float size2 = dot(s.normal, s.normal);
    if (size2 > 1e-30) s.normal = facing * mappedNormal(facing * s.normal * inversesqrt(size2), facing);
#endif
#if (MAPS & MAP_OCCLUSION) != 0
    s.occlusion = 1.0 + look.strengths.y * (texture(occlusionImage, placed(3)).r - 1.0);
#endif
#if (MAPS & MAP_EMISSIVE) != 0
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
