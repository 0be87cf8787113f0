#include "common/output/MeshLook.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace tessera {
namespace {

struct Flat {
    double x = 0, y = 0;
    friend Flat operator-(Flat a, Flat b) { return {a.x - b.x, a.y - b.y}; }
    friend Flat operator+(Flat a, Flat b) { return {a.x + b.x, a.y + b.y}; }
};
double cross(Flat a, Flat b) {
    return a.x * b.y - a.y * b.x;
}

/// Of a face: a pixel on an edge belongs to both of its faces, whatever the last bits are.
constexpr double kEdge = 1e-6;

bool inFace(double t) {
    return t >= -kEdge && t <= 1 + kEdge;
}

/// Where a point lies in a face that is bilinear in s and t: p = a + s·e + t·f + s·t·g. The cross product with e + t·g
/// leaves an equation of the second degree in t.
struct InFace {
    double s = 0, t = 0;
};
std::optional<InFace> placeInFace(Flat p, Flat a, Flat e, Flat f, Flat g) {
    const Flat h = p - a;
    const double k2 = cross(g, f), k1 = cross(e, f) + cross(h, g), k0 = cross(h, e);
    const double square = k1 * k1 - 4 * k0 * k2;
    if (square < 0) return std::nullopt;
    const double q = -0.5 * (k1 + std::copysign(std::sqrt(square), k1));
    for (const double t : {q != 0 ? k0 / q : 2.0, k2 != 0 ? q / k2 : 2.0}) {
        if (!inFace(t)) continue;
        const Flat along{e.x + t * g.x, e.y + t * g.y};
        const double s = std::abs(along.x) > std::abs(along.y) ? (h.x - t * f.x) / along.x : (h.y - t * f.y) / along.y;
        if (inFace(s)) return InFace{std::clamp(s, 0.0, 1.0), std::clamp(t, 0.0, 1.0)};
    }
    return std::nullopt;
}

}  // namespace

void lookThrough(const WarpMesh& mesh, int widthPx, int heightPx,
                 const std::function<void(int x, int y, const Look&)>& see) {
    // In pixels, where a pixel's centre has whole numbers.
    const auto placeOf = [&](const WarpNode& n) {
        return Flat{0.5 * (n.x + 1.0) * widthPx - 0.5, 0.5 * (1.0 - n.y) * heightPx - 0.5};
    };
    for (int row = 0; row + 1 < mesh.rows; ++row) {
        for (int column = 0; column + 1 < mesh.columns; ++column) {
            const WarpNode* const nodes[4] = {&mesh.at(column, row), &mesh.at(column + 1, row),
                                              &mesh.at(column + 1, row + 1), &mesh.at(column, row + 1)};
            Flat corners[4];
            Flat least{1e300, 1e300}, most{-1e300, -1e300};
            for (int i = 0; i < 4; ++i) {
                corners[i] = placeOf(*nodes[i]);
                least = {std::min(least.x, corners[i].x), std::min(least.y, corners[i].y)};
                most = {std::max(most.x, corners[i].x), std::max(most.y, corners[i].y)};
            }
            const Flat a = corners[0], e = corners[1] - a, f = corners[3] - a,
                       g = a - corners[1] + corners[2] - corners[3];
            const auto from = [](double v) { return std::max(0, static_cast<int>(std::floor(v))); };
            const auto to = [](double v, int size) { return std::min(size - 1, static_cast<int>(std::ceil(v))); };
            for (int y = from(least.y); y <= to(most.y, heightPx); ++y) {
                for (int x = from(least.x); x <= to(most.x, widthPx); ++x) {
                    const auto in = placeInFace({static_cast<double>(x), static_cast<double>(y)}, a, e, f, g);
                    if (!in) continue;
                    const double weights[4] = {(1 - in->s) * (1 - in->t), in->s * (1 - in->t), in->s * in->t,
                                               (1 - in->s) * in->t};
                    Look look{0, 0, 0};
                    for (int i = 0; i < 4; ++i) {
                        look.u += weights[i] * nodes[i]->u;
                        look.v += weights[i] * (1.0 - nodes[i]->v);
                        look.intensity += weights[i] * nodes[i]->intensity;
                    }
                    see(x, y, look);
                }
            }
        }
    }
}

}  // namespace tessera
