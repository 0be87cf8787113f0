// From radiance to what a screen shows.

// Khronos PBR Neutral (2024) without its toe: the identity up to 0.8, so that colours stay what they are; highlights
// fade towards white.
vec3 toneMap(vec3 c) {
    float peak = min(max(max(c.r, c.g), c.b), 1e8);
    // newPeak = 1 - 0.04 / a; whiter = 1 - 1 / (0.15 (peak - newPeak) + 1): one division for three.
    float a = max(peak - 0.6, 0.2), bounded = max(peak, 0.8);
    float b = a * (0.85 + 0.15 * peak) + 0.006;
    float all = 1.0 / (a * b * bounded);
    float newPeak = 1.0 - 0.04 * all * b * bounded;
    float whiter = 1.0 - a * (a * bounded) * all;
    vec3 bright = mix(c * (newPeak * a * b * all), vec3(newPeak), whiter);
    return peak <= 0.8 ? c : bright;
}

// sRGB's curve as a polynomial of the square root (minimax, by Remez' exchange): a fifth of a step of 255 off at most.
// Of curve and line the larger one is the right one, once the line ends where they meet.
vec3 encodeSrgb(vec3 c) {
    c = clamp(c, vec3(0.0), vec3(1.0));
    vec3 s = sqrt(c);
    vec3 curve = (((-0.309571871 * s + 0.842791157) * s - 0.944860931) * s + 1.44789934) * s - 0.0370046656;
    return max(curve, min(12.92 * c, vec3(0.04045)));
}
