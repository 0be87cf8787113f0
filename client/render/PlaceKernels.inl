// One source for two instruction sets: TESSERA_PLACES names the one that this is compiled for. `Lanes` are kLanes items
// side by side, `Floats` as many in single precision; the file that includes this says how they are loaded and stored.

namespace tessera::places::TESSERA_PLACES {

namespace {

inline Lanes least(Lanes a, Lanes b) {
    return a < b ? a : b;
}
inline Lanes greatest(Lanes a, Lanes b) {
    return a > b ? a : b;
}

/// The pointers of kLanes items from `first` on; those beyond the end are the last one's.
template <typename Pointer>
inline void pick(const Pointer* from, std::size_t first, std::size_t count, Pointer (&to)[kLanes]) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) to[lane] = from[first + lane < count ? first + lane : count - 1];
}

void beforeEye(Matrix eye_T_world, const Matrix* world_T_item, float* const* rows, std::size_t count) {
    for (std::size_t first = 0; first < count; first += kLanes) {
        Matrix item[kLanes];
        float* out[kLanes];
        pick(world_T_item, first, count, item);
        pick(rows, first, count, out);
        Lanes world[4][4];  // by column and row
#pragma GCC unroll 4
        for (int c = 0; c < 4; ++c) load(item, 4 * c, world[c]);
        Lanes m[3][4];
        for (int r = 0; r < 3; ++r) {
            const Lanes x = all(eye_T_world[r]), y = all(eye_T_world[4 + r]), z = all(eye_T_world[8 + r]);
            for (int c = 0; c < 4; ++c) {
                const Lanes a = x * world[c][0], b = y * world[c][1], d = z * world[c][2];
                // As pictures have always been rounded.
                m[r][c] = r == 2 ? a + (b + d) : (a + b) + d;
            }
            m[r][3] += all(eye_T_world[12 + r]);
            store(out, 4 * r, rounded(m[r][0]), rounded(m[r][1]), rounded(m[r][2]), rounded(m[r][3]));
        }
        // The matrix of cofactors is the inverse transpose times the determinant, and exists where the inverse does
        // not.
        Lanes cofactors[3][3], largest = all(0);
        for (int r = 0; r < 3; ++r) {
            const Lanes* a = m[(r + 1) % 3];
            const Lanes* b = m[(r + 2) % 3];
            for (int c = 0; c < 3; ++c) {
                const int next = (c + 1) % 3, last = (c + 2) % 3;
                cofactors[r][c] = a[next] * b[last] - a[last] * b[next];
                largest = greatest(magnitude(cofactors[r][c]), largest);
            }
        }
        const auto part = [&m](int a, int b, int c) { return m[0][a] * (m[1][b] * m[2][c] - m[1][c] * m[2][b]); };
        const Lanes determinant = part(0, 1, 2) - part(1, 0, 2) + part(2, 0, 1);
        const Lanes scale = largest > all(0) ? (determinant < all(0) ? -largest : largest) : all(1);
        for (int r = 0; r < 3; ++r)
            store(out, 12 + 4 * r, rounded(cofactors[r][0] / scale), rounded(cofactors[r][1] / scale),
                  rounded(cofactors[r][2] / scale), Floats{});
    }
}

void onScreen(const Screen& screen, const double* const* boxes, const Matrix* world_T_item, Rectangle* found,
              std::size_t count) {
    // What decides about pixels: clip x, y and w, by column.
    Lanes clip[4][3];
    for (int c = 0; c < 4; ++c)
        for (int r = 0; r < 3; ++r) clip[c][r] = all(screen.clip_T_world[4 * c + (r == 2 ? 3 : r)]);
    for (std::size_t first = 0; first < count; first += kLanes) {
        const double* box[kLanes];
        Matrix item[kLanes];
        pick(boxes, first, count, box);
        pick(world_T_item, first, count, item);
        Lanes sides[2][4], origin[4];  // lower x y z, upper x; lower z, upper x y z
        load(box, 0, sides[0]);
        load(box, 2, sides[1]);
        load(item, 12, origin);
        const Lanes lower[3] = {sides[0][0], sides[0][1], sides[0][2]};
        const Lanes upper[3] = {sides[1][1], sides[1][2], sides[1][3]};
        // Sums of components are never below lengths.
        Lanes reach = all(0);
        for (int k = 0; k < 3; ++k) {
            const Lanes farthest = greatest(magnitude(upper[k] - origin[k]), magnitude(lower[k] - origin[k]));
            reach += all(2) * farthest + all(0.5) * (upper[k] - lower[k]) +
                     magnitude(all(0.5) * (lower[k] + upper[k]) - all(screen.eye[k]));
        }
        const Lanes noise = all(screen.rounding) * reach;
        Lanes corners[8][3], leastDepth = all(__builtin_inf()), lowerX = leastDepth, lowerY = lowerX, upperX = -lowerX,
                             upperY = upperX;
        for (int r = 0; r < 3; ++r) {
            corners[0][r] = ((clip[0][r] * lower[0] + clip[1][r] * lower[1]) + clip[2][r] * lower[2]) + clip[3][r];
            for (int k = 0; k < 3; ++k) {
                const Lanes edge = clip[k][r] * (upper[k] - lower[k]);
                for (int i = 0; i < 1 << k; ++i) corners[i + (1 << k)][r] = corners[i][r] + edge;
            }
        }
        for (int i = 0; i < 8; ++i) {
            const Lanes inverse = all(1) / corners[i][2];
            const Lanes x = corners[i][0] * inverse, y = corners[i][1] * inverse;
            leastDepth = least(corners[i][2], leastDepth);
            lowerX = least(x, lowerX);
            lowerY = least(y, lowerY);
            upperX = greatest(x, upperX);
            upperY = greatest(y, upperY);
        }
        const Lanes nobody = all(__builtin_nan(""));
        const Lanes grown = leastDepth >= all(screen.leastDepth) + noise
                                ? all(1 + screen.margin) + noise * all(screen.pixelsPerMetre) / (leastDepth - noise)
                                : nobody;
        const Lanes result[4] = {lowerX * all(screen.halfWidth) + all(screen.offsetX) - grown,
                                 lowerY * all(screen.halfHeight) + all(screen.offsetY) - grown,
                                 upperX * all(screen.halfWidth) + all(screen.offsetX) + grown,
                                 upperY * all(screen.halfHeight) + all(screen.offsetY) + grown};
        for (std::size_t lane = 0; lane < kLanes && first + lane < count; ++lane)
            found[first + lane] = {of(result[0], lane), of(result[1], lane), of(result[2], lane), of(result[3], lane)};
    }
}

}  // namespace

extern const PlaceKernels kKernels;
const PlaceKernels kKernels{&beforeEye, &onScreen};

}  // namespace tessera::places::TESSERA_PLACES
