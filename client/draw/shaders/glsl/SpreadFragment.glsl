// The second colours of pixels into the samples that show them.

layout(binding = 1) uniform sampler2DRect rest;
layout(location = 0) out vec4 outColor;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 color = texelFetch(rest, at);
    uvec2 first = SAMPLE(surfaces, 0).xy;
    vec3 n = normalOf(first.x);
    int covered = 0;
    for (int i = 1; i < SAMPLES; ++i) {
        uvec2 other = SAMPLE(surfaces, i).xy;
        covered |= sameSurface(materialOf(first), n, materialOf(other), normalOf(other.x)) ? 0 : 1 << i;
    }
    gl_SampleMask[0] = color.a > 0.0 ? covered : 0;
    outColor = vec4(color.rgb, 0.0);
}
