// Second pass: light on what the samples of a pixel show.

#if SAMPLES > 1
layout(binding = 1) uniform sampler2DMS depths;
#else
layout(binding = 1) uniform sampler2DRect depths;
#endif
layout(binding = 2) uniform samplerBuffer materials;
#ifdef METER
layout(location = 0) out uint outClass;
#else
layout(location = 0) out vec4 outColor;
#endif

void main() {
    ivec2 at = ivec2(PIXEL);
#if SAMPLES > 1 && !defined(ONE_SURFACE)
    uvec2 of[SAMPLES];
    FETCH_SAMPLES(of)
    uvec2 surface = of[0];
#else
    uvec2 surface = SAMPLE(surfaces, 0).xy;
#endif
#ifdef METER
    // Where nothing is, of one sample, nobody has cleared it.
    surface = SAMPLE(depths, 0).x > 0.0 ? surface : uvec2(0u);
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
#ifdef SUNS_ALONE
    // What is infinitely far away shines the same everywhere: only which way one looks counts.
    vec3 position = toCorner.xyz + PIXEL.x * acrossPixel.xyz + PIXEL.y * upPixel.xyz;
#else
    float depth = SAMPLE(depths, sampleOf).x;
    vec4 eye = eye_T_clip * vec4(PIXEL * clipPerPixel.xy - 1.0, depth, 1.0);
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
    vec3 c = emissiveAndRoughness.rgb;
#ifdef COATED
    c *= lit.below;
#endif
    c += max(litness, 0.0) * (lit.diffuse + lit.specular);
    // A plain background is as bright as it says.
    bool shines = material != 0u;
#ifdef ENVIRONMENT
    // Where nothing is.
    bool seen = material == 0u && surround[1].w > 0.5;
    vec3 d = vec3(dot(worldRow0.xyz, position), dot(worldRow1.xyz, position), dot(worldRow2.xyz, position));
    c = seen ? mapOf(onSquare(d), 0.0) : c;
    litness = seen ? 0.0 : litness;
    shines = shines || seen;
#endif
#ifdef METER
    // LightHistogram.h.
    float sum = dot(c, vec3(0.2126, 0.7152, 0.0722));
    float luminance = sum > 1e-30 ? sum : 1e-30;  // also of what is no number
    float place = (log2(luminance) - LEAST_STOPS) * CLASSES_PER_STOP;
    outClass = shines && litness >= 0.0 ? uint(clamp(place, 0.0, MOST_CLASSES - 2.0)) + 1u : 0u;
#else
    c = shines ? exposed(c) : c;
#ifdef STUDIO
    vec3 backdrop = emissiveAndRoughness.rgb * (1.0 + 0.6 * smoothstep(-0.5, 0.3, falls));
    c = onGround ? mix(backdrop, exposed(lit.diffuse), lies) : c;
#endif
    c = litness < 0.0 ? base : toneMap(c);
    outColor = vec4(encodeSrgb(c), share);
#endif
}
