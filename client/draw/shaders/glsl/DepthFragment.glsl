// Nothing but depth, for what culls.

void main() {
#ifdef POINTS
    meetBall();
#endif
}
