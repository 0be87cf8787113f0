// How light falls on a surface.
//
// Metal-roughness as glTF 2.0 (appendix B) defines it: GGX distribution, Smith's visibility in Hammon's approximation
// (2017), Schlick's Fresnel term. A light of radiance 1 that falls straight onto a white surface gives 1: the factor pi
// is taken into the light. A software rasteriser has no jumps (lanes are masked, not skipped): so there are no
// branches.

#ifdef ENVIRONMENT
// The surroundings' picture, made soft (EnvironmentLight.h): sides and first rows of its maps are those of that file.
layout(binding = 11) uniform sampler2D surroundings;
vec2 onSquare(vec3 d) {
    d /= abs(d.x) + abs(d.y) + abs(d.z);
    vec2 folded = (1.0 - abs(d.zx)) * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(d.xz, vec2(0.0)));
    return (d.y >= 0.0 ? d.xz : folded) * 0.5 + 0.5;
}
vec3 mapOf(vec2 square, float level) {
    float side = level < 0.5 ? 512.0 : level < 1.5 ? 128.0 : level < 2.5 ? 64.0 : 32.0;
    float row = level < 0.5 ? 0.0 : level < 1.5 ? 514.0 : level < 2.5 ? 644.0 : 710.0 + 34.0 * (level - 3.0);
    return textureLod(surroundings, (vec2(1.0, row + 1.0) + square * side) / vec2(514.0, 812.0), 0.0).rgb *
        surround[0].w;
}
vec3 environment(vec3 d, float roughness) {
    vec2 square = onSquare(d);
    float level = 5.0 * roughness, below = min(floor(level), 4.0);
    return mix(mapOf(square, below), mapOf(square, below + 1.0), level - below);
}
vec3 ambient(vec3 n) {
    vec3 d = vec3(dot(worldRow0.xyz, n), dot(worldRow1.xyz, n), dot(worldRow2.xyz, n));
    vec3 sum = surround[0].rgb + surround[1].rgb * d.y + surround[2].rgb * d.z + surround[3].rgb * d.x;
    sum += surround[4].rgb * (d.x * d.y) + surround[5].rgb * (d.y * d.z) + surround[6].rgb * (3.0 * d.z * d.z - 1.0);
    return max(sum + surround[7].rgb * (d.x * d.z) + surround[8].rgb * (d.x * d.x - d.y * d.y), vec3(0.0));
}
#else
vec3 ambient(vec3 n) { return mix(ground.rgb, sky.rgb, 0.5 + 0.5 * dot(n, worldRow1.xyz)); }
// Radiance from a direction in the world: sky, horizon and ground, and three lamps as in a photographer's studio, so
// that metal has something to reflect. A function of the direction alone; a rough surface sees it blurred.
vec3 environment(vec3 d, float roughness) {
    float blur = 0.06 + 0.94 * roughness, breadth = 0.18 + 0.6 * roughness;
    float breadth2 = breadth * breadth, horizon = breadth2 + 4.0 * d.y * d.y;
    float dimming = 1.0 + 5.0 * roughness * roughness;
    // One division for three.
    float all = 1.0 / (blur * horizon * dimming);
    float invBlur = all * horizon * dimming;
    float up = clamp(0.5 + 0.5 * d.y * invBlur, 0.0, 1.0);
    vec3 c = mix(ground.rgb, sky.rgb, up * up * (3.0 - 2.0 * up));
    vec3 toLamps = vec3(d.y, dot(d, vec3(0.64, 0.48, 0.60)), dot(d, vec3(-0.80, 0.36, 0.48)));
    // Steps from 0.7 blur below to 0.06 blur above where each lamp's edge is.
    vec3 lamps = clamp((toLamps - vec3(0.90, 0.93, 0.95)) * (invBlur / 0.76) + 0.7 / 0.76, 0.0, 1.0);
    lamps *= lamps * (3.0 - 2.0 * lamps);
    return c + sky.rgb * (0.35 * breadth2 * (all * blur * dimming) +
                          dot(lamps, vec3(2.2, 3.0, 1.6)) * (all * blur * horizon));
}
#endif

vec3 inWorld(vec3 d) { return vec3(dot(worldRow0.xyz, d), dot(worldRow1.xyz, d), dot(worldRow2.xyz, d)); }

// Integrals over light from everywhere, seen at nv, fitted from nv = 0.2 up. x: lost between facets where each reflects
// all, of addRay's lobe to 0.005. y: what Schlick's term turns from f0 to f90, of Smith's own visibility to 0.016, and
// to 0.045 of addRay's.
vec2 lobeShares(float roughness, float nv) {
    float alpha = roughness * roughness;
    float away = (1.0 - nv) * (1.0 - nv) * (0.0437 - 0.0383 * roughness);
    float slope = nv * nv + 0.0458 + 0.4548 * alpha + nv * (0.0181 - 0.6525 * roughness);
    float wide = nv + 1.3 * alpha;
    // One division for two.
    float all = 1.0 / (slope * wide);
    float h = nv * all * slope;
    vec4 lost = vec4(-0.0033, 1.9108, -2.9917, 1.0875) +
                alpha * (vec4(0.117, -3.4524, 6.7543, -4.7044) +
                         alpha * (vec4(-0.0407, 4.9458, -3.2933, -2.0486) +
                                  alpha * vec4(-0.0366, -0.2622, -6.7564, 11.5393)));
    return vec2(max(lost.x + h * (lost.y + h * (lost.z + h * lost.w)), 0.0), away * all * wide);
}
// How many times as much leaves the facets after all bounces as after the first. Of what is lost at one a share goes
// out after the next: a geometric series. Each bounce leaves what Schlick's term is on the mean (Fdez-Agüera 2019, "A
// multiple-scattering microfacet model for real-time image based lighting").
vec3 bouncedOn(vec3 f0, float f90, float lost) { return 1.0 / (1.0 - lost * mix(f0, vec3(f90), 1.0 / 21.0)); }

// What a material says of how it reflects (MaterialTexels in Program.h), and of the lights that reach it.
struct Gloss {
    vec4 specular;
    float shininess;
    uint scopes;
};
const Gloss kPlainGloss = Gloss(vec4(0.04, 0.04, 0.04, 1.0), -1.0, 0u);

struct Lit {
    vec3 position, n, v;
    vec3 f0, more;  // of Schlick's term, with all bounces: what light reflects that falls straight, what more at most
#ifdef GLOSSY
    float shininess;  // of Phong's surfaces f0 is the highlight's colour; the exponent is below 0 for others
    // Of what is no metal: f0 of its strongest colour (what is tinted lets through what that leaves,
    // KHR_materials_specular), and f90.
    vec2 strongest;
#endif
#ifdef SCOPED
    uint scopes;
#endif
    float nv, alpha, alpha2;
    vec3 diffuse, specular;
#ifdef COATED
    float coatAlpha, coatAlpha2;
    vec3 coat;  // what a whole layer of lacquer reflects
    float below;  // how much of what comes from below it arrives at the eye
#endif
};

#ifdef STUDIO
bool onGround;  // it is the studio's that is lit
#endif

layout(binding = 9) uniform samplerBuffer lightTexels;
layout(binding = 10) uniform usamplerBuffer lightLists;

// Light that comes from l, of length 1.
void addRay(inout Lit lit, vec3 l, vec3 radiance) {
    float nl = clamp(dot(lit.n, l), 0.0, 1.0);
    // With h = (l + v) / |l + v|: h.v is half of |l + v|, whose square is 2 + 2 l.v, and n.h = (n.l + n.v) / (2 h.v).
    // So nothing needs a vector h, and the lobe, with (h.v)^4 above and below, no division but its own.
    float hv2 = max(0.5 + 0.5 * dot(l, lit.v), 2.5e-7), hv4 = hv2 * hv2;
    float both = nl + lit.nv, twice = 2.0 * nl * lit.nv;
    float nh2 = min(0.25 * both * both, hv2);  // (n.h)^2 (h.v)^2
    float grazing = 1.0 - min(sqrt(hv2), 1.0);
    float grazing2 = grazing * grazing, grazing5 = grazing2 * grazing2 * grazing;
    vec3 fresnel = lit.f0 + lit.more * grazing5;
    float q = nh2 * (lit.alpha2 - 1.0) + hv2;
    float lobe = 0.5 * lit.alpha2 * hv4 / max(q * q * (twice + (both - twice) * lit.alpha), 1e-6 * hv4);
    vec3 arriving = radiance * nl;
#ifdef GLOSSY
    // As OpenGL's lights have it (OpenGL 1.5, 2.14.1): (n.h)^shininess wherever light falls at all, not times n.l.
    float highlight = nl > 0.0 ? exp2(lit.shininess * 0.5 * log2(max(nh2 / hv2, 1e-30))) : 0.0;
    bool phong = lit.shininess >= 0.0;
    float through = 1.0 - mix(lit.strongest.x, lit.strongest.y, grazing5);
    lit.diffuse += phong ? arriving : arriving * through;
    lit.specular += phong ? radiance * highlight * lit.f0 : arriving * min(lobe, 40.0) * fresnel;
#else
    // glTF 2.0, B.2: what is partly metal is a mix of two surfaces, and what the other one lets through is its own.
    lit.diffuse += arriving * (0.96 - 0.96 * grazing5);
    lit.specular += arriving * min(lobe, 40.0) * fresnel;
#endif
#ifdef COATED
    q = nh2 * (lit.coatAlpha2 - 1.0) + hv2;
    lobe = 0.5 * lit.coatAlpha2 * hv4 / max(q * q * (twice + (both - twice) * lit.coatAlpha), 1e-6 * hv4);
    lit.coat += arriving * min(lobe, 40.0) * (0.04 + 0.96 * grazing5);
#endif
}

void addLight(inout Lit lit, vec4 place, vec4 radiance, vec4 cone, vec4 falloff) {
    vec3 l = place.xyz - lit.position * place.w;
    float d2 = max(dot(l, l), 1e-8);
    float invD = inversesqrt(d2);
    l *= invD;
    // Window of KHR_lights_punctual: the light is zero at its range. Of a directional light, place.w is 0.
    float x2 = d2 * radiance.w * radiance.w;
    // Its cone: squared, so that it fades without an edge.
    float inCone = clamp(cone.w - dot(l, cone.xyz), 0.0, 1.0);
    // 1 / (x + y d + z d²), by the inverse of d: with 0 0 1 the square alone, to the bit.
    float invD2 = invD * invD;
    float fallen = min(invD2 / max(falloff.x * invD2 + falloff.y * invD + falloff.z, 1e-30), 1e18);
    float strength = inCone * inCone * mix(1.0, fallen * max(1.0 - x2 * x2, 0.0), place.w);
#ifdef SCOPED
    // falloff.w: a scope's number, below 0 where it lights what is outside.
    bool within = ((lit.scopes >> uint(max(abs(falloff.w) - 1.0, 0.0))) & 1u) != 0u;
    strength = falloff.w == 0.0 || within == (falloff.w > 0.0) ? strength : 0.0;
#endif
    addRay(lit, l, radiance.rgb * strength);
}

#if LIGHTS == LIGHTS_SHADOWS
layout(binding = 12) uniform sampler2DArrayShadow shadowMaps;
#ifdef ONE_SUN
bool knows(int view, vec4 place) {
    vec3 q = vec3(dot(sunRows[3 * view], place), dot(sunRows[3 * view + 1], place), dot(sunRows[3 * view + 2], place));
    return all(greaterThan(q, vec3(sunInside.zz, 0.0))) && all(lessThan(q, vec3(sunInside.ww, 1.0)));
}

// As `arrives` below, of a sun: a software rasteriser reads what comes from a vertex once for all pixels. Rays that
// fall on a surface's back, and places that no map knows, need no tap: a loop is left where no pixel of a stamp goes
// on.
float arrives(vec3 position, vec3 n) {
    vec4 place = vec4(position, 1.0);
    bool near = knows(0, place), middle = knows(1, place);
    vec4 row0 = near ? sunRows[0] : middle ? sunRows[3] : sunRows[6];
    vec4 row1 = near ? sunRows[1] : middle ? sunRows[4] : sunRows[7];
    vec4 row2 = near ? sunRows[2] : middle ? sunRows[5] : sunRows[8];
    float pixel = near ? sunTowards.w : middle ? sunRadiance.w : sunLayers.w;
    float layer = near ? sunLayers.x : middle ? sunLayers.y : sunLayers.z;
    float facing = dot(n, sunTowards.xyz);
    float slope = sqrt(max(1.0 - facing * facing, 0.0));
    vec4 p = vec4(position + pixel * ((0.5 + 1.5 * slope) * n + 1.0 * sunTowards.xyz), 1.0);
    vec3 q = vec3(dot(row0, p), dot(row1, p), clamp(dot(row2, p), 0.0, 1.0));
    bool known = all(greaterThan(q.xy, sunInside.xx)) && all(lessThan(q.xy, sunInside.yy));
    vec2 tap = 0.75 * clipPerPixel.zw;
    float taps = known && facing > 0.0 ? 4.0 : 0.0, sum = 0.0;
    for (float i = 0.5; i < taps; i += 1.0) {
        vec2 beside = vec2(i == 0.5 || i == 2.5 ? -tap.x : tap.x, i < 2.0 ? -tap.y : tap.y);
        sum += texture(shadowMaps, vec4(q.xy + beside, layer, q.z));
    }
    return known ? 0.25 * sum : 1.0;
}
#else
/// Whether a place lies in the map of a view, not at its rim, and between its depths.
bool knows(int view, vec4 place) {
    vec3 q = vec3(dot(texelFetch(lightTexels, view), place), dot(texelFetch(lightTexels, view + 1), place),
                  dot(texelFetch(lightTexels, view + 2), place)) /
             max(dot(texelFetch(lightTexels, view + 3), place), 1e-6);
    vec4 inside = texelFetch(lightTexels, view + 5);
    return all(greaterThan(q, vec3(mix(inside.xy, inside.zw, 0.01), 0.0))) &&
           all(lessThan(q, vec3(mix(inside.zw, inside.xy, 0.01), 1.0)));
}

// How much of a light arrives: `at` is the first texel of its views (ShadowMaps.h). Four taps of four pixels each.
// Looked for a little above the surface, by pixels of the map, so that it does not shade itself (Holbert 2011, "Saying
// goodbye to shadow acne"); beyond the map's edge everything arrives.
float arrives(int at, vec3 position, vec3 n, vec3 towards) {
#ifdef CUBES
    // Of a light that shines to all sides the view along whose axis the place lies farthest: the fourth rows of every
    // other one say how far along an axis of the world.
    vec4 cube = texelFetch(lightTexels, at + 5);
    int sides = max(int(cube.y), 0);
    vec3 along = vec3(dot(texelFetch(lightTexels, sides + 3), vec4(position, 1.0)),
                      dot(texelFetch(lightTexels, sides + 15), vec4(position, 1.0)),
                      dot(texelFetch(lightTexels, sides + 27), vec4(position, 1.0)));
    vec3 far = abs(along);
    int axis = far.x >= far.y && far.x >= far.z ? 0 : far.y >= far.z ? 1 : 2;
    bool behind = (axis == 0 ? along.x : axis == 1 ? along.y : along.z) < 0.0;
    int side = sides + 12 * axis + (behind ? 6 : 0);
#endif
    // The finest that knows the place.
    at += knows(at, vec4(position, 1.0)) ? 0 : knows(at + 6, vec4(position, 1.0)) ? 6 : 12;
#ifdef CUBES
    at = cube.x < 0.0 ? side : at;
#endif
    vec4 row0 = texelFetch(lightTexels, at), row1 = texelFetch(lightTexels, at + 1);
    vec4 row2 = texelFetch(lightTexels, at + 2), row3 = texelFetch(lightTexels, at + 3);
    vec3 size = texelFetch(lightTexels, at + 4).xyz;
    vec4 inside = texelFetch(lightTexels, at + 5);
    float pixel = size.x + size.y * max(dot(row3, vec4(position, 1.0)), 0.0);
    float slope = sqrt(max(1.0 - dot(n, towards) * dot(n, towards), 0.0));
    float lift = 1.5;
#ifdef CUBES
    // Where a side of a cube ends a surface may lie along its axis: from pixel to pixel its depth changes most there.
    lift = cube.x < 0.0 ? 2.25 : lift;
#endif
    vec4 p = vec4(position + pixel * ((0.5 + lift * slope) * n + 1.0 * towards), 1.0);
    float w = dot(row3, p);
    vec3 q = vec3(dot(row0, p), dot(row1, p), dot(row2, p)) / max(w, 1e-6);
    q.z = clamp(q.z, 0.0, 1.0);
    vec2 tap = 0.75 * shadows.zw;
    // Of one level: whatever derivatives are here.
    float sum = texture(shadowMaps, vec4(q.xy + vec2(-tap.x, -tap.y), size.z, q.z)) +
                texture(shadowMaps, vec4(q.xy + vec2(tap.x, -tap.y), size.z, q.z)) +
                texture(shadowMaps, vec4(q.xy + vec2(-tap.x, tap.y), size.z, q.z)) +
                texture(shadowMaps, vec4(q.xy + vec2(tap.x, tap.y), size.z, q.z));
    bool known = w > 1e-6 && all(greaterThan(q.xy, inside.xy)) && all(lessThan(q.xy, inside.zw));
    return known ? 0.25 * sum : 1.0;
}
#endif
#ifdef STUDIO
// The same on the studio's ground, from the coarsest view alone: as soft everywhere. Taps on a spiral lie at as many
// distances from any straight edge. The loop ends at once where no pixel of a stamp is on the ground.
float arrivesSoftly(int at, vec3 position) {
    at += 12;
    vec4 p = vec4(position, 1.0);
    vec3 q = vec3(dot(texelFetch(lightTexels, at), p), dot(texelFetch(lightTexels, at + 1), p),
                  clamp(dot(texelFetch(lightTexels, at + 2), p), 0.0, 1.0));
    float layer = texelFetch(lightTexels, at + 4).z;
    vec4 inside = texelFetch(lightTexels, at + 5);
    bool known = onGround && all(greaterThan(q.xy, inside.xy)) && all(lessThan(q.xy, inside.zw));
    float taps = known ? 24.0 : 0.0, sum = 0.0;
    vec2 towards = vec2(1.0, 0.0);
    for (float i = 0.5; i < taps; i += 1.0) {
        sum += texture(shadowMaps, vec4(q.xy + towards * (14.0 * sqrt(i / 24.0) * shadows.z), layer, q.z));
        towards = mat2(-0.7374, 0.6755, -0.6755, -0.7374) * towards;  // the golden angle
    }
    return known ? sum / 24.0 : 1.0;
}
#endif
#endif

/// Diffusely and specularly reflected radiance towards the eye, for a surface with a unit normal in eye space.
/// `occlusion`: the share of the surroundings' light that arrives. `coat`: of lacquer over it
/// (KHR_materials_clearcoat), and its roughness. `gloss`: counts where GLOSSY, SCOPED are defined.
Lit light(vec3 position, vec3 n, vec3 base, float metallic, float roughness, float occlusion, vec2 coat, Gloss gloss) {
    vec3 v = normalize(-position);
    float nvRaw = dot(n, v);
    float nv = max(nvRaw, 1e-3);
    // What is partly metal is a mix of two surfaces (glTF 2.0, B.2), each with bounces of its own.
    vec2 shares = lobeShares(roughness, nv);
    vec3 bounced = bouncedOn(base, 1.0, shares.x);
#ifdef GLOSSY
    // Phong's surfaces have no facets, and mirror nothing.
    bool facets = gloss.shininess < 0.0;
    vec3 others = facets ? bouncedOn(gloss.specular.rgb, gloss.specular.a, shares.x) : vec3(1.0);
    bounced = facets ? bounced : vec3(1.0);
    vec3 f0 = mix(gloss.specular.rgb * others, base * bounced, metallic);
    vec3 more = mix(gloss.specular.a * others, bounced, metallic) - f0;
    vec2 strongest = vec2(max(max(gloss.specular.r, gloss.specular.g), gloss.specular.b), gloss.specular.a);
    vec3 mirrored = facets ? f0 * (1.0 - shares.x) + more * shares.y : vec3(0.0);
#else
    float others = bouncedOn(vec3(0.04), 1.0, shares.x).r;
    vec3 f0 = mix(vec3(0.04 * others), base * bounced, metallic);
    vec3 more = mix(vec3(others), bounced, metallic) - f0;
    vec3 mirrored = f0 * (1.0 - shares.x) + more * shares.y;
#endif
    vec3 diffuse = occlusion * ambient(n);
    vec3 r = 2.0 * nvRaw * n - v, lean = r;
    // What is mirrored, with all bounces, does not reach what lies below: a white thing in white surroundings is as
    // white as they are. What is tinted lets through what its strongest colour leaves.
#ifdef GLOSSY
    float kept = (strongest.x * (1.0 - shares.x) + (strongest.y - strongest.x) * shares.y) *
                 max(max(others.r, others.g), others.b);
    kept = facets ? kept : 0.0;
#else
    float kept = (0.04 * (1.0 - shares.x) + 0.96 * shares.y) * others;
#endif
#ifdef STUDIO
    // Its ground is matt.
    kept = onGround ? 0.0 : kept;
#endif
    diffuse *= 1.0 - kept;
#ifdef ENVIRONMENT
    // The rougher, the farther a lobe leans towards the normal: its light does not come from below the surface
    // (Lagarde and de Rousiers 2014, "Moving Frostbite to physically based rendering", 4.9.3).
    lean = mix(r, n, roughness * roughness * roughness * roughness);
#endif
    vec3 specular = occlusion * mirrored * environment(inWorld(lean), roughness);
    float alpha = roughness * roughness;
    Lit lit;
    lit.position = position;
    lit.n = n;
    lit.v = v;
    lit.f0 = f0;
    lit.more = more;
#ifdef GLOSSY
    lit.strongest = strongest;
    lit.shininess = gloss.shininess;
#endif
#ifdef SCOPED
    lit.scopes = gloss.scopes;
#endif
    lit.nv = nv;
    lit.alpha = alpha;
    lit.alpha2 = alpha * alpha;
    lit.diffuse = diffuse;
    lit.specular = specular;
#ifdef COATED
    float coatRoughness = max(coat.y, 0.045);
    lit.coatAlpha = coatRoughness * coatRoughness;
    lit.coatAlpha2 = lit.coatAlpha * lit.coatAlpha;
    vec2 coatShares = lobeShares(coatRoughness, nv);
    lit.coat = occlusion * (0.04 * (1.0 - coatShares.x) + 0.96 * coatShares.y) * environment(inWorld(r), coatRoughness);
#endif
#ifdef ONE_SUN
    addRay(lit, sunTowards.xyz, sunRadiance.rgb * arrives(position, n));
#elif LIGHTS == LIGHTS_SHADOWS
    uint one = 0u;
    do {
        int at = int(shadows.x) + 22 * int(one);
        vec4 place = texelFetch(lightTexels, at), radiance = texelFetch(lightTexels, at + 1);
        vec3 towards = normalize(place.xyz - position * place.w);
        float arriving = arrives(at + 4, position, n, towards);
#ifdef STUDIO
        float softly = arrivesSoftly(at + 4, position);
        arriving = onGround ? softly : arriving;
#endif
        radiance.rgb *= arriving;
        addLight(lit, place, radiance, texelFetch(lightTexels, at + 2), texelFetch(lightTexels, at + 3));
    } while (++one < uint(shadows.y));
#endif
#ifdef ONE_SUN
    // There is no other light.
#elif defined(SUNS_ALONE)
    addRay(lit, suns[0].xyz, suns[1].rgb);
#if LIGHTS == LIGHTS_SUNS
    addRay(lit, suns[2].xyz, suns[3].rgb);
    addRay(lit, suns[4].xyz, suns[5].rgb);
#endif
#elif LIGHTS == LIGHTS_FEW
    // What they do not have is said as numbers, so that a compiler leaves it out; the sums are those of the loop below,
    // to the bit.
    const vec4 noCone = vec4(0.0, 0.0, 0.0, 1.0), bySquare = vec4(0.0, 0.0, 1.0, 0.0);
    addLight(lit, vec4(few[0].xyz, 0.0), vec4(few[1].rgb, 0.0), noCone, bySquare);
    addLight(lit, vec4(few[2].xyz, 1.0), few[3], noCone, bySquare);
    addLight(lit, vec4(few[4].xyz, 1.0), few[5], noCone, bySquare);
    addLight(lit, vec4(few[6].xyz, 1.0), few[7], noCone, bySquare);
    addLight(lit, vec4(few[8].xyz, 1.0), few[9], noCone, bySquare);
#else
    // One light at least (LightClusters.h): a loop without a test at its start, because a software rasteriser would go
    // through it once more, with nothing to do.
    uint k = 0u;
#if LIGHTS == LIGHTS_ALL
    uint count = uint(slices.w);
#else
    int slice = int(clamp(log2(max(-position.z, 1e-30)) * slices.x + slices.y, 0.0, 31.0));
    ivec2 column = ivec2(PIXEL) >> 6;
    int cluster = 2 * ((slice * 9 + column.y) * 16 + column.x);
    uint list = texelFetch(lightLists, cluster).x, count = texelFetch(lightLists, cluster + 1).x;
    uint everywhere = uint(slices.z);
#endif
    do {
#if LIGHTS == LIGHTS_ALL
        int index = int(k);
#else
        int index = int(k < everywhere ? k : texelFetch(lightLists, int(k < everywhere ? 0u : list + k)).x);
#endif
        addLight(lit, texelFetch(lightTexels, 4 * index), texelFetch(lightTexels, 4 * index + 1),
                 texelFetch(lightTexels, 4 * index + 2), texelFetch(lightTexels, 4 * index + 3));
    } while (++k < count);
#endif
    lit.diffuse *= base * (1.0 - metallic);
#ifdef COATED
    // What the lacquer reflects towards the eye does not come from below it.
    float grazing = 1.0 - nv;
    float grazing2 = grazing * grazing;
    lit.below = 1.0 - coat.x * (0.04 + 0.96 * grazing2 * grazing2 * grazing);
    lit.diffuse *= lit.below;
    lit.specular = lit.specular * lit.below + coat.x * lit.coat;
#endif
    return lit;
}
