// The mean of the samples where something was blended over any of them.

layout(binding = 0) uniform sampler2DMS blended;
layout(location = 0) out vec4 outColor;

void main() {
    vec4 sum = vec4(0.0);
    for (int i = 0; i < SAMPLES; ++i) sum += texelFetch(blended, ivec2(gl_FragCoord.xy), i);
    if (sum.a == 0.0) discard;
    outColor = vec4(sum.rgb / float(SAMPLES), 1.0);
}
