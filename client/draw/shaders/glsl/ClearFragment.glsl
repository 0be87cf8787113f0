// What the first pass begins with.

layout(location = 0) out uvec2 outSurface;
#ifdef DETAIL
layout(location = 1) out uvec2 outDetail;
#endif
void main() {
    outSurface = uvec2(0u);
#ifdef DETAIL
    outDetail = uvec2(0u);
#endif
}
