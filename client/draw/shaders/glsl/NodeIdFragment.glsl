// Which node is seen: for picking.

flat in uvec2 vNode;
layout(location = 0) out uvec2 outNode;
void main() {
#ifdef POINTS
    meetBall();
#endif
#if defined(MASKED)
    if (aboveCutoff(surface()) < 0.0) discard;
#elif defined(PERSON)
    surface();
#endif
    outNode = vNode;
}
