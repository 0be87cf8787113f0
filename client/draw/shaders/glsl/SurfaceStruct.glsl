// What is said of a pixel.

struct Surface {
    vec3 normal;  // as long as it comes
    vec4 base;
    float metallic, roughness, occlusion;
    vec3 emissive;
};
