// The curves from exposed radiance to a screen's linear colours, by the names of Environment::toneMap. ToneCurves.cpp
// compiles this text as C++, in double precision: no swizzles here, and a constructor for each vector.

// Khronos PBR Neutral (2024) without its toe: the identity up to 0.8, so that colours stay what they are; highlights
// fade towards white.
vec3 neutral(vec3 c) {
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

// Whatever is brighter than white is white.
vec3 clipped(vec3 c) { return min(c, vec3(1.0)); }

// Reinhard, Stark, Shirley and Ferwerda 2002, "Photographic tone reproduction for digital images", equation 3, of each
// channel by itself.
vec3 reinhard(vec3 c) {
    vec3 bounded = min(c, vec3(1e8));
    return bounded / (vec3(1.0) + bounded);
}

// Hill 2017: a fit of the Academy's reference rendering transform and of its output for sRGB screens (ACES 1.0), with
// radiance 1 / 0.6 times as bright, as three.js has it.
vec3 aces(vec3 c) {
    mat3 toRendering = mat3(vec3(0.59719, 0.07600, 0.02840), vec3(0.35458, 0.90834, 0.13383),
        vec3(0.04823, 0.01566, 0.83777));
    mat3 toScreen = mat3(vec3(1.60475, -0.10208, -0.00327), vec3(-0.53108, 1.10813, -0.07276),
        vec3(-0.07367, -0.00605, 1.07602));
    vec3 v = toRendering * (min(c, vec3(1e8)) * (1.0 / 0.6));
    // (v (v + 0.0245786) - 0.000090537) / (v (0.983729 v + 0.432951) + 0.238081); where v is large the same of 1 / v.
    vec3 scale = vec3(1.0) / max(v, vec3(1.0));
    vec3 s = v * scale;
    vec3 above = s * (s + 0.0245786 * scale) - 0.000090537 * (scale * scale);
    vec3 below = s * (0.983729 * s + 0.4329510 * scale) + 0.238081 * (scale * scale);
    return clamp(toScreen * (above / below), vec3(0.0), vec3(1.0));
}

// Sobotka 2022, "AgX", its default contrast: in Rec. 2020, with the polynomial of Wrensch 2023 ("Minimal AgX
// implementation") for the sigmoid, as Blender, Filament and three.js show it.
vec3 agx(vec3 c) {
    mat3 toRec2020 = mat3(vec3(0.6274, 0.0691, 0.0164), vec3(0.3293, 0.9195, 0.0880), vec3(0.0433, 0.0113, 0.8956));
    mat3 toSrgb = mat3(vec3(1.6605, -0.1246, -0.0182), vec3(-0.5876, 1.1329, -0.1006), vec3(-0.0728, -0.0083, 1.1187));
    mat3 inset = mat3(vec3(0.856627153315983, 0.137318972929847, 0.11189821299995),
        vec3(0.0951212405381588, 0.761241990602591, 0.0767994186031903),
        vec3(0.0482516061458583, 0.101439036467562, 0.811302368396859));
    mat3 outset = mat3(vec3(1.1271005818144368, -0.1413297634984383, -0.14132976349843826),
        vec3(-0.11060664309660323, 1.157823702216272, -0.11060664309660294),
        vec3(-0.016493938717834573, -0.016493938717834257, 1.2519364065950405));
    float least = -12.47393, most = 4.026069;  // stops
    vec3 v = inset * (toRec2020 * min(c, vec3(1e8)));
    vec3 x = clamp((log2(max(v, vec3(1e-10))) - vec3(least)) * (1.0 / (most - least)), vec3(0.0), vec3(1.0));
    vec3 x2 = x * x;
    vec3 x4 = x2 * x2;
    vec3 curve = 15.5 * (x4 * x2) - 40.14 * (x4 * x) + 31.96 * x4 - 6.868 * (x2 * x) + 0.4298 * x2 + 0.1191 * x -
        vec3(0.00232);
    vec3 linear = pow(max(outset * curve, vec3(0.0)), vec3(2.2));
    return clamp(toSrgb * linear, vec3(0.0), vec3(1.0));
}
