// Scalar fields: rays through them, and planes (VolumeTextures.h).
//
// A ray's samples lie in the middle of pieces that end at multiples of the step from the eye: what they are depends on
// the screen, the eye and the volume alone. Colours are blended as bytes stand, as all that is transparent here.
// MARCHED: bits of MARCH_… (VolumeTextures.h). Pieces that lie in empty bricks are counted, not looked at: the same
// numbers come of it. All that is conditional is a loop: a software rasteriser does both sides of an if.

layout(std140, binding = 3) uniform VolumeBlock {
    vec4 stepsRow0, stepsRow1, stepsRow2;
    vec4 nodeRow0, nodeRow1, nodeRow2;
    vec4 last, texel, toTable, march;
    vec4 clips[64];
} volume;
layout(binding = 20) uniform sampler3D voxels;
layout(binding = 21) uniform samplerBuffer transfer;
#ifdef MARCHED
#if (MARCHED & MARCH_KIND) == MARCH_MAXIMUM
layout(binding = 22) uniform sampler3D bricks;
#else
layout(binding = 22) uniform usampler3D bricks;
#endif
#endif

#ifdef MARCHED
centroid in vec3 vPosition;
#else
in vec3 vPosition;
#endif
layout(location = 0) out vec4 outColor;

// At a place in voxels from the first one's middle.
float fieldAt(vec3 at, vec3 texel) { return textureLod(voxels, (at + 0.5) * texel, 0.0).r; }
vec4 colored(float value, vec4 toTable) {
    float place = clamp(value * toTable.x + toTable.y, 0.0, toTable.z), below = min(floor(place), toTable.z - 1.0);
    int first = int(toTable.w) + int(below);
    return mix(texelFetch(transfer, first), texelFetch(transfer, first + 1), place - below);
}

#ifdef SLICES
void main() {
    vec4 eye = vec4(vPosition, 1.0);
    vec3 at = vec3(dot(volume.stepsRow0, eye), dot(volume.stepsRow1, eye), dot(volume.stepsRow2, eye));
    outColor = colored(fieldAt(clamp(at, vec3(0.0), volume.last.xyz), volume.texel.xyz), volume.toTable);
}
#else

#if SAMPLES > 1
layout(binding = 1) uniform sampler2DMS depths;
#define DEPTH(i) texelFetch(depths, ivec2(gl_FragCoord.xy), i).r
#else
layout(binding = 1) uniform sampler2DRect depths;
#define DEPTH(i) texelFetch(depths, ivec2(gl_FragCoord.xy)).r
#endif

// How far in front of the eye what is solid lies; beyond all where nothing is.
float wayTo(float z) {
    vec2 at = eye_T_clip[2].zw * z + eye_T_clip[3].zw;
    return -at.x / at.y;
}
float solidAt(int i) {
    float z = DEPTH(i);
    return z > 0.0 ? wayTo(z) : 1e30;
}

// log2(1 - a), what is opaque as good as that after its thickness (VolumeTextures.h); a software rasteriser's logarithm
// is no good near 1.
float clearness(float a) {
    float series = -1.44269504 * a * (1.0 + a * (0.5 + a * (0.33333333 + a * (0.25 + a * (0.2 + a * 0.16666667)))));
    return a < 0.125 ? series : log2(max(1.0 - a, 1.0 / 65536.0));
}

// Over all pieces but the last whose middles lie in bricks that are empty: those nearer than so many steps. False, and
// nothing is another: there is something, or might be.
bool leap(float steps, vec3 brick, vec3 at, vec3 from3, vec3 inverse, float margin, float perPace, float lastPiece,
          inout float piece, inout int left) {
    vec3 lower = (brick - (steps - 1.0)) * BRICK_SIDE + margin, upper = (brick + steps) * BRICK_SIDE - margin;
    vec3 out3 = max((lower - from3) * inverse, (upper - from3) * inverse);
    float leaves = min(min(out3.x, out3.y), out3.z);
    float next = min(min(floor(leaves * perPace + 0.5) + 1.0, lastPiece), piece + float(left) - 1.0);
    bool leaps = steps > 0.0 && next > piece && all(greaterThan(at, lower)) && all(lessThan(at, upper));
    left -= leaps ? int(next - piece) : 0;
    piece = leaps ? next : piece;
    return leaps;
}

#if (MARCHED & MARCH_KIND) == MARCH_SHADED
vec3 linearOf(vec3 c) {
    return mix(pow((max(c, vec3(0.04045)) + 0.055) / 1.055, vec3(2.4)), c / 12.92, lessThanEqual(c, vec3(0.04045)));
}
// Both sides are lit: the normal is the one that faces the eye. Where it changes sides, and where the field turns round
// or is even, so that there is none, a normal would come of nothing: it has faded to the way to the eye before. How
// much the field goes one way is what it differs by between the two sides of a voxel, of what it goes up and down on
// its way: no matter how steep it is. `value`: here; `perValue`: of a value's share of the transfer function.
const float kEdgeOn = 0.7, kOneWay = 0.5, kEven = 1.0 / 512.0;  // a cosine; a share; of the transfer function
vec3 shadedAt(vec3 at, float value, vec3 eye, vec3 color, vec3 last, vec3 texel, mat3 steps_T_eye, float perValue,
              Gloss gloss) {
    vec3 lower = max(at - 1.0, vec3(0.0)), upper = min(at + 1.0, last);
    vec3 before = vec3(fieldAt(vec3(lower.x, at.yz), texel), fieldAt(vec3(at.x, lower.y, at.z), texel),
        fieldAt(vec3(at.xy, lower.z), texel));
    vec3 after = vec3(fieldAt(vec3(upper.x, at.yz), texel), fieldAt(vec3(at.x, upper.y, at.z), texel),
        fieldAt(vec3(at.xy, upper.z), texel));
    vec3 slope = (after - before) / (upper - lower);
    float way = length(after - before) / (length(abs(after - value) + abs(value - before)) + kEven / perValue);
    // Gradients are rows: those of the eye's coordinates are the steps' times the matrix.
    vec3 n = slope * steps_T_eye, towards = normalize(-eye);
    n *= inversesqrt(max(dot(n, n), 1e-30));
    float cosine = dot(n, towards);
    float share = smoothstep(0.0, kEdgeOn, abs(cosine)) * smoothstep(0.0, kOneWay, way);
    n = normalize(mix(towards, cosine < 0.0 ? -n : n, share));
    Lit lit = light(eye, n, linearOf(color), 0.0, 1.0, 1.0, vec2(0.0), gloss);
    return encodeSrgb(toneMap(exposed(lit.diffuse)));
}
#endif

void main() {
    // Places along the ray are s times this: s is how far they are before the eye.
    vec3 ray = vPosition / -vPosition.z;
    vec3 last = volume.last.xyz, texel = volume.texel.xyz;
    vec4 toTable = volume.toTable;
    vec3 from3 = vec3(volume.stepsRow0.w, volume.stepsRow1.w, volume.stepsRow2.w);
    mat3 steps_T_eye = transpose(mat3(volume.stepsRow0.xyz, volume.stepsRow1.xyz, volume.stepsRow2.xyz));
    vec3 along = steps_T_eye * ray;
    vec3 inverse = 1.0 / mix(along, vec3(1e-30), lessThan(abs(along), vec3(1e-30)));
    vec3 one = -from3 * inverse, other = (last - from3) * inverse;
    vec3 near3 = min(one, other), far3 = max(one, other);
    float near = max(max(near3.x, near3.y), max(near3.z, wayTo(1.0))), far = min(min(far3.x, far3.y), far3.z);
    int plane = 0;
    do {
        vec4 clip = volume.clips[plane];
        float towards = dot(clip.xyz, ray), where = -clip.w / (abs(towards) < 1e-30 ? 1e-30 : towards);
        near = towards < -1e-30 ? max(near, where) : near;
        far = towards > 1e-30 ? min(far, where) : abs(towards) <= 1e-30 && clip.w > 0.0 ? -1.0 : far;
    } while (++plane < int(volume.last.w));
    float perDepth = length(vec3(dot(volume.nodeRow0.xyz, ray), dot(volume.nodeRow1.xyz, ray),
        dot(volume.nodeRow2.xyz, ray)));
    float pace = volume.march.x / perDepth;
#if SAMPLES > 1
    float least = 1e30, most = -1e30, sum = 0.0;
    for (int i = 0; i < SAMPLES; ++i) {
        float stop = clamp(solidAt(i), near, max(near, far));
        least = min(least, stop);
        most = max(most, stop);
        sum += stop;
    }
    bool several = most - least > pace;
#if (MARCHED & MARCH_EACH_SAMPLE) != 0
    far = several ? min(far, solidAt(gl_SampleID)) : -1.0;
#else
    far = several ? -1.0 : min(far, sum * (1.0 / float(SAMPLES)));
#endif
#else
    far = min(far, solidAt(0));
#endif
    bool met = far > near;
    far = met ? far : near;
    float piece = floor(near / pace) + 1.0, perPace = 1.0 / pace, lastPiece = floor(far / pace);
    // So far within a brick its samples are surely its own.
    float margin = 1e-3 + 1e-6 * max(max(abs(from3.x), abs(from3.y)), abs(from3.z));
    int left = MOST_SAMPLES;
    // Pixels that have left a loop go through it with their neighbours, and some of what it says is read anew from what
    // it has left (Mesa's llvmpipe keeps variables, not results): so an inner loop's last turn changes no variable, and
    // what is summed up is tested at the start.
    bool more = true;
#if (MARCHED & MARCH_KIND) == MARCH_MAXIMUM
    float greatest = -3.4e38;
    while (more) {
        float end;
        vec3 at;
        bool lower;
        do {
            end = clamp(piece * pace, near, far);
            at = clamp(from3 + along * (0.5 * (clamp((piece - 1.0) * pace, near, far) + end)), vec3(0.0), last);
            vec3 brick = floor(at * BRICK_INVERSE);
            float most = texelFetch(bricks, ivec3(brick), 0).r;
            lower = leap(most <= greatest ? 1.0 : 0.0, brick, at, from3, inverse, margin, perPace, lastPiece, piece,
                left);
        } while (lower);
        greatest = max(greatest, fieldAt(at, texel));
        piece += 1.0;
        --left;
        // Beyond its last stop the transfer function is what it is there.
        more = end < far && greatest * toTable.x + toTable.y < toTable.z && left > 0;
    }
    vec4 color = colored(greatest, toTable);
    outColor = vec4(color.rgb, met ? color.a : 0.0);
#else
    Gloss gloss = kPlainGloss;
    gloss.scopes = look.material.w;
    float perLength = perDepth * volume.march.y, clear = 1.0, exponent = 0.0;
    vec3 seen = vec3(0.0);
    while (more) {
        // To the next place where there is anything: nothing else is done for what is empty.
        vec4 color;
        vec3 at;
        float begin, end, middle, value;
        bool empty;
        do {
            do {
                begin = clamp((piece - 1.0) * pace, near, far);
                end = clamp(piece * pace, near, far);
                middle = 0.5 * (begin + end);
                at = clamp(from3 + along * middle, vec3(0.0), last);
                vec3 brick = floor(at * BRICK_INVERSE);
                float steps = float(texelFetch(bricks, ivec3(brick), 0).r);
                empty = leap(steps, brick, at, from3, inverse, margin, perPace, lastPiece, piece, left);
            } while (empty);
            value = fieldAt(at, texel);
            color = colored(value, toTable);
            empty = color.a <= 0.0 && end < far && left > 1;
            piece += empty ? 1.0 : 0.0;
            left -= empty ? 1 : 0;
        } while (empty);
        exponent = max(exponent + (end - begin) * perLength * clearness(color.a), -30.0);
        float clearBehind = exponent > -30.0 ? exp2(exponent) : 0.0;
#if (MARCHED & MARCH_KIND) == MARCH_SHADED
        color.rgb = shadedAt(at, value, ray * middle, color.rgb, last, texel, steps_T_eye, toTable.x / toTable.z,
            gloss);
#endif
        seen += (clear - clearBehind) * color.rgb;
        clear = clearBehind;
        piece += 1.0;
        --left;
        more = end < far && clear > 0.0005 && left > 0;
    }
    float alpha = 1.0 - clear;
    outColor = vec4(seen / max(alpha, 1e-6), met ? alpha : 0.0);
#endif
}
#endif
