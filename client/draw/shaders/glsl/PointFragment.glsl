// What of the triangle is the ball. Each sample has its own ray and depth; all samples of a pixel that show one ball
// have the normal of one place of it, where the pixel's middle is, or what of the ball is nearest to that: so a pixel
// that shows one ball is lit once.

layout(depth_less) out float gl_FragDepth;
flat in vec4 vBall;
flat in vec4 vRays;
flat in vec4 vDepth;
#ifdef ROWS
flat in vec3 vRow0, vRow1, vRow2;
#endif
#ifdef IN_ITEM
flat in vec4 vPoint;
#endif
vec3 ballNormal = vec3(0.0), vPosition = vec3(0.0), ballItem = vec3(0.0);

// Of the ray through a place of the picture: begin + t * along, in the eye's coordinates.
vec3 alongOf(vec2 place) { return vec3(vDepth.z * place, -1.0); }
vec3 beginOf(vec2 place) { return vec3((1.0 - vDepth.z) * place, 0.0); }
// Where it is a ball.
vec3 asBall(vec3 v) {
#if (POINTS & POINT_STRETCHED) != 0
    return vRow0 * v.x + vRow1 * v.y + vRow2 * v.z;
#else
    return v;
#endif
}
float ballRadius() {
#if (POINTS & POINT_STRETCHED) != 0
    return 1.0;
#else
    return abs(vBall.w);
#endif
}

// The place of a ray that is nearest to the centre: how far along it, and from the centre to there. Not by a difference
// of squares, which is nothing any more of a small ball far away (Haines and others 2019, "Precision improvements for
// ray/sphere intersection").
float nearestTo(vec2 place, out vec3 along, out vec3 off, out float inverse) {
    along = asBall(alongOf(place));
    vec3 centre = vBall.xyz - asBall(beginOf(place));
    inverse = 1.0 / dot(along, along);
    float t = dot(centre, along) * inverse;
    off = t * along - centre;
    return t;
}

// Where a ray meets it whose place nearest to the centre is known. `left2`: below 0, it does not.
float meets(float middle, vec3 off, float inverse, float side, float radius2, out float left2) {
    if (vDepth.w > 0.0) {
        precise float square = middle * middle - vDepth.w * inverse;
        left2 = middle > 0.0 ? square : -1.0;
        precise float near = vDepth.w * inverse / (middle + sqrt(max(square, 0.0)));
        return near;
    }
    precise float left = radius2 - dot(off, off);
    left2 = left;
    precise float t = middle - side * sqrt(max(left, 0.0) * inverse);
    return t;
}

void meetBall() {
    vec2 pixel = floor(gl_FragCoord.xy), place = (pixel + 0.5) * vRays.xy + vRays.zw;
    float side = vBall.w < 0.0 ? -1.0 : 1.0, radius2 = ballRadius() * ballRadius();
    vec3 along, off;
    float inverse;
#if SAMPLES > 1
    precise float middle = nearestTo((pixel + gl_SamplePosition) * vRays.xy + vRays.zw, along, off, inverse);
#else
    precise float middle = nearestTo(place, along, off, inverse);
#endif
    float left2;
    precise float t = meets(middle, off, inverse, side, radius2, left2);
    precise float depth = vDepth.z > 0.5 ? vDepth.y / t - vDepth.x : vDepth.y - vDepth.x * t;
#ifdef SHADOW
    // A sun's: what is before its depths stands at their front.
    bool between = vDepth.z > 0.5 ? t > 0.0 && depth <= 1.0 && depth >= 0.0 : true;
    depth = clamp(depth, 0.0, 1.0);
#else
    bool between = t > 0.0 && depth <= 1.0 && depth >= 0.0;
#endif
    if (!(left2 >= 0.0) || !between) discard;
    gl_FragDepth = depth;
#ifdef SURFACE
#if SAMPLES > 1
    middle = nearestTo(place, along, off, inverse);
#endif
    // Past the ball: the outline's nearest.
    t = meets(middle, off, inverse, side, radius2, left2);
    vec3 fromCentre = off + (t - middle) * along;
#if (POINTS & POINT_STRETCHED) != 0
    ballNormal = vec3(dot(vRow0, fromCentre), dot(vRow1, fromCentre), dot(vRow2, fromCentre));
#else
    ballNormal = fromCentre / ballRadius();
#endif
    vPosition = beginOf(place) + t * alongOf(place);
#ifdef IN_ITEM
#if (POINTS & POINT_STRETCHED) != 0
    ballItem = fromCentre;
#else
    ballItem = vRow0 * fromCentre.x + vRow1 * fromCentre.y + vRow2 * fromCentre.z;
#endif
    ballItem = vPoint.xyz + vPoint.w * normalize(ballItem);
#endif
#endif
}
