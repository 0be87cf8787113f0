// Points: balls that no triangle stands for. The rasteriser is given a triangle around each one's outline; what of it
// is the ball, and how deep, is found for each sample from the ray through it. So a picture shows the ball itself, and
// what a tile shows follows from the place of the pixel in its cell and from the ball alone, whatever triangle brought
// it there.
//
// POINTS says what points have (POINT_…, DrawForms.h). POINT_STRETCHED: their item stretches them. Then the fragments
// look where they are a ball of radius 1: `normalRow` are the transposed of what takes a way there.
//
// Eight vertex numbers a point: 0 to 2 are the triangle of what is seen from outside, 4 to 6 that of the inside, wound
// the other way, which nothing but glass shows unless the near plane cuts the ball. One triangle, not a tighter
// hexagon: a software rasteriser shades whole stamps of pixels, twice where two triangles meet (that cost a scan a
// third more).

flat out vec4 vBall;  // its centre, and its radius: below 0 for what is seen from inside
flat out vec4 vRays;  // from a pixel to where its ray is a metre before the eye
// What a way along a ray has to do with depth; 1, or 0 where rays are parallel; what the eye is off a far larger ball,
// see below, or 0.
flat out vec4 vDepth;
#ifdef ROWS
flat out vec3 vRow0, vRow1, vRow2;
#endif
#ifdef IN_ITEM
flat out vec4 vPoint;  // centre and radius in the item's own coordinates
#endif

void fetch() {
    int at = (gl_VertexID >> 3) * (1 + ((POINTS >> 1) & 1) + ((POINTS >> 2) & 1));
    uvec4 point = texelFetch(fetched, at);
    position = uintBitsToFloat(point.xyz);
#ifdef SURFACE
#if (POINTS & POINT_NORMALS) != 0
    normal = uintBitsToFloat(texelFetch(fetched, at + 1).xyz);
#endif
#if (POINTS & POINT_COLORS) != 0
    color = linearColor(point.w);
#endif
#if (POINTS & POINT_TEXCOORDS) != 0
    vec4 both = uintBitsToFloat(texelFetch(fetched, at + 1 + ((POINTS >> 1) & 1)));
    texcoord = both.xy;
    texcoord1 = both.zw;
#endif
#endif
}

// How far a linear form of eye space varies from the centre to the surface, as a vector: along which, how much.
vec3 overBall(vec3 form) {
#if (POINTS & POINT_STRETCHED) != 0
    return uintBitsToFloat(itemSize.x) * (eyeRow0.xyz * form.x + eyeRow1.xyz * form.y + eyeRow2.xyz * form.z);
#else
    return uintBitsToFloat(itemSize.x) * form;
#endif
}

// A line that touches the outline, across a direction: how far from the middle of the viewport. All in units of the
// centre's clip w: a of the centre, b over the ball, bw of w. It is where a plane through the eye touches:
// (a - k)^2 = |b - k bw|^2.
float touching(float a, vec3 b, vec3 bw, float inverse) {
    vec3 across = b - a * bw, turned = cross(b, bw);
    return (a - dot(b, bw) + sqrt(max(dot(across, across) - dot(turned, turned), 0.0))) * inverse;
}

vec4 aroundBall(vec3 centre) {
    const vec3 row0 = vec3(clip_T_eye[0][0], clip_T_eye[1][0], clip_T_eye[2][0]);
    const vec3 row1 = vec3(clip_T_eye[0][1], clip_T_eye[1][1], clip_T_eye[2][1]);
    const vec3 row2 = vec3(clip_T_eye[0][2], clip_T_eye[1][2], clip_T_eye[2][2]);
    const vec3 row3 = vec3(clip_T_eye[0][3], clip_T_eye[1][3], clip_T_eye[2][3]);
    bool inside = (gl_VertexID & 4) != 0, parallel = clip_T_eye[3][3] == 1.0;
    vec4 at = clip_T_eye * vec4(centre, 1.0);
    vec3 x = overBall(row0), y = overBall(row1), w = overBall(row3);
    float reach = length(w);
    vRays = pixelRays;
    vDepth = vec4(clip_T_eye[2][2], clip_T_eye[3][2], parallel ? 0.0 : 1.0, 0.0);
    float radius = inside ? -uintBitsToFloat(itemSize.x) : uintBitsToFloat(itemSize.x);
#if (POINTS & POINT_STRETCHED) != 0
    vBall = vec4(normalRow0.xyz * centre.x + normalRow1.xyz * centre.y + normalRow2.xyz * centre.z, sign(radius));
#else
    vBall = vec4(centre, radius);
#endif
    // From right above a planet the centre is as far as the surface behind it: what two such lengths differ by would be
    // noise, of each pixel another one. So the power of the eye to the ball is found once, and rays meet the ball by it
    // (Citardauq's formula).
    float toCentre = length(vBall.xyz), ballSize = abs(vBall.w), power = (toCentre - ballSize) * (toCentre + ballSize);
    if (!parallel && !inside && power > 0.0 && power < 1e-3 * ballSize * ballSize) vDepth.w = power;
    // Depth where it is nearest: no fragment's is more (DEPTH_LESS).
    float nearest = parallel       ? at.z + length(overBall(row2))
                    : at.w > reach ? clip_T_eye[3][2] / (at.w - reach) - clip_T_eye[2][2]
                                   : 2.0;
    bool cut = nearest > 0.9999;
    bool shown = !inside || cut;
#ifdef BLENDED
    shown = true;
#endif
    // What lies before the near plane as a whole, or beyond a side.
    float farthest = parallel ? 0.0 : clip_T_eye[3][2] / max(at.w + reach, 1e-30) - clip_T_eye[2][2];
    shown = shown && at.w + reach > 0.0 && farthest <= 1.0;
    shown = shown && at.w - at.x > -length(w - x) && at.w + at.x > -length(w + x);
    shown = shown && at.w - at.y > -length(w - y) && at.w + at.y > -length(w + y);
    float depth = clamp(nearest + 1e-5 * abs(nearest), 0.0, 1.0);
    int corner = gl_VertexID & 3;
    if (!shown) return vec4(2.0, 2.0, 0.0, 1.0);
    // It reaches the plane of the eye, where it has no outline.
    if (!(at.w > 1.01 * reach)) return vec4(corner == 1 ? 3.0 : -1.0, corner == 2 ? 3.0 : -1.0, depth, 1.0);
    vec2 pixels = 1.0 / clipPerPixel.xy;
    float inverseW = 1.0 / at.w;
    vec2 middle = at.xy * inverseW * pixels;
    x *= inverseW * pixels.x;
    y *= inverseW * pixels.y;
    w *= inverseW;
    float inverse = 1.0 / (1.0 - dot(w, w));
    // Two sides meet in a corner: those across e and f, a third of a turn apart.
    vec2 e = corner == 0 ? vec2(-0.8660254, 0.5) : corner == 1 ? vec2(0.0, -1.0) : vec2(0.8660254, 0.5);
    vec2 f = vec2(-0.5 * e.x - 0.8660254 * e.y, 0.8660254 * e.x - 0.5 * e.y);
    // A little more than it is, as corners are rounded; and no farther than the viewport.
    float most = 4.0 * (pixels.x + pixels.y);
    float k = clamp(touching(dot(e, middle), e.x * x + e.y * y, w, inverse) + 0.05, -most, most);
    float l = clamp(touching(dot(f, middle), f.x * x + f.y * y, w, inverse) + 0.05, -most, most);
    vec2 p = 1.3333333 * ((k + 0.5 * l) * e + (l + 0.5 * k) * f);
    return vec4(p * clipPerPixel.xy, depth, 1.0);
}
