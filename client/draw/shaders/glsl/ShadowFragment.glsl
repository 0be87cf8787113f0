// Nothing but depth, and holes where alpha cuts them.

void main() {
#ifdef POINTS
    meetBall();
#endif
#if defined(MASKED)
    if (aboveCutoff(surface()) < 0.0) discard;
#elif defined(PERSON)
    surface();
#endif
}
