// What is transparent: surface and light in one.

layout(location = 0) out vec4 outColor;

void main() {
#ifdef POINTS
    meetBall();
#endif
    Surface s = surface();
    vec3 n = s.normal;
    float length2 = dot(n, n);
    n = length2 > 1e-30 ? n * inversesqrt(length2) : normalize(-vPosition);
    vec2 coat = vec2(0.0);
    float through = 0.0, unlit = 0.0;
#ifdef MAPS
    through = look.effects.x * (1.0 - s.metallic);
    unlit = look.effects.y;
    coat = look.effects.zw;
#endif
    Gloss gloss = kPlainGloss;
#ifdef GLOSSY
    gloss.specular = look.specular;
    gloss.shininess = look.metallic.y;
#endif
    gloss.scopes = look.material.w;
    Lit lit = light(vPosition, n, s.base.rgb, s.metallic, s.roughness, s.occlusion, coat, gloss);
    // What light goes through takes the colour of what is behind it, as far as it has one of its own not, and shows its
    // highlights and its own light all the same. Alpha weakens all of it.
    vec3 glow = s.emissive;
#ifdef COATED
    glow *= lit.below;
#endif
    float a = 1.0 - through * max(max(s.base.r, s.base.g), s.base.b);
    vec3 diffuse = exposed(lit.diffuse), specular = exposed(lit.specular);
    glow = exposed(glow);
    vec3 shining = specular + glow;
    float shine = min(max(max(shining.r, shining.g), shining.b), 1.0) * (1.0 - unlit);
    float dense = a + (1.0 - a) * shine;
    vec3 c = (diffuse * (1.0 - through) + glow + specular) / max(dense, 1e-3);
    c = unlit > 0.5 ? s.base.rgb : toneMap(c);
    outColor = vec4(encodeSrgb(c), clamp(s.base.a, 0.0, 1.0) * dense);
}
