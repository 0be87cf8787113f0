// Sorts pixels by the work that they are: a software rasteriser has no jumps, but the depth test leaves out blocks of
// sixteen pixels with which a pass has nothing to do. 0: the background alone; 0.5: all samples show the same;
// 0.75: one surface, its normal or colour differs; 1: may be several, see sameSurface.

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    uvec2 of[SAMPLES];
    FETCH_SAMPLES(of)
    uvec2 first = of[0];
    uvec2 all = first, differ = uvec2(0u);
    bvec2 apart = bvec2(false);
    uvec2 oct = uvec2(first.x, first.x >> 13u) & 8191u;
#ifdef DETAIL
    uvec2 detail = SAMPLE(details, 0).xy;
#endif
    for (int i = 1; i < SAMPLES; ++i) {
        uvec2 other = of[i];
        uvec2 bits = other ^ first;
        all |= other;
        differ |= bits;
#ifdef DETAIL
        differ |= SAMPLE(details, i).xy ^ detail;
#endif
        // A twentieth of the octahedron's map is at most 15 degrees.
        uvec2 otherOct = uvec2(other.x, other.x >> 13u) & 8191u;
        apart = bvec2(uvec2(apart) | uvec2(greaterThan(max(oct, otherOct) - min(oct, otherOct), uvec2(400u))) |
                      uvec2(bits.x >> 26u, bits.y >> 24u));
    }
    float work = (differ.x | differ.y) == 0u ? 0.5 : any(apart) ? 1.0 : 0.75;
    // What has to be gone through anyway takes its neighbours along.
    float mixed = work > 0.5 ? 1.0 : 0.0;
    mixed += abs(dFdxFine(mixed));
    mixed += abs(dFdyFine(mixed));
    work = mixed > 0.0 ? max(work, 0.75) : work;
    // A background that is a picture is a surface like others.
    gl_FragDepth = (all.x | all.y) == 0u && surround[1].w < 0.5 ? 0.0 : work;
}
