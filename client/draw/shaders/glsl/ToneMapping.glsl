// From radiance to what a screen shows. After ToneCurves; TONE_CURVE: which.

// Twice as bright for each stop; sky.w is 1 where nobody asks for any. What follows takes numbers alone: no infinity.
vec3 exposed(vec3 radiance) { return min(radiance * sky.w, vec3(1e30)); }

vec3 toneMap(vec3 c) { return TONE_CURVE(c); }

// sRGB's curve as a polynomial of the square root (minimax, by Remez' exchange): a fifth of a step of 255 off at most.
// Of curve and line the larger one is the right one, once the line ends where they meet.
vec3 encodeSrgb(vec3 c) {
    c = clamp(c, vec3(0.0), vec3(1.0));
    vec3 s = sqrt(c);
    vec3 curve = (((-0.309571871 * s + 0.842791157) * s - 0.944860931) * s + 1.44789934) * s - 0.0370046656;
    return max(curve, min(12.92 * c, vec3(0.04045)));
}
