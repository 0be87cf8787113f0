#include "client/draw/shaders/ShaderText.h"

namespace tessera::shader_text {

const char kDepthFragment[] = R"(
void main() {
#ifdef POINTS
    meetBall();
#endif
}
)";

const char kPlateVertex[] = R"(
layout(location = 0) in vec3 corner;
void main() { gl_Position = vec4(corner, 1.0); }
)";

// Reversed depth: the farthest is the least.
const char kFarthestFragment[] = R"(
layout(binding = 0) uniform sampler2DMS depths;
layout(location = 0) out float outFarthest;
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    float farthest = texelFetch(depths, at, 0).r;
    for (int i = 1; i < SAMPLES; ++i) farthest = min(farthest, texelFetch(depths, at, i).r);
    outFarthest = farthest;
}
)";

}  // namespace tessera::shader_text
