// A picture into every sample.

layout(binding = 0) uniform sampler2DRect picture;
layout(location = 0) out vec4 outColor;
void main() { outColor = vec4(texelFetch(picture, ivec2(gl_FragCoord.xy)).rgb, 0.0); }
