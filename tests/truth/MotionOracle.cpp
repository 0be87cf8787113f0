#include "tests/truth/MotionOracle.h"

#include <algorithm>
#include <limits>
#include <map>
#include <vector>

#include "tests/truth/IntervalMotion.h"
#include "tests/truth/NearPoints.h"

namespace tessera::truth {
namespace {

constexpr double kShortest = 0x1p-46;       ///< of spans of time
constexpr std::size_t kMostSpans = 30'000;  ///< looked at, in one search

struct Mesh {
    std::vector<IVec> vertices;  ///< in the body's own frame
    std::vector<std::array<std::uint32_t, 3>> faces;
    std::vector<std::array<std::uint32_t, 2>> edges;

    Mesh(const TriangleMesh& mesh, const IntervalWay& way) {
        std::map<std::array<double, 3>, std::uint32_t> known;
        std::map<std::array<std::uint32_t, 2>, bool> edgeKnown;
        for (std::uint32_t f = 0; f < mesh.faceCount(); ++f) {
            std::array<std::uint32_t, 3>& face = faces.emplace_back();
            for (unsigned i = 0; i < 3; ++i) {
                const Vec3d p = mesh.corner(f, i);
                const auto [at, isNew] =
                    known.try_emplace({p.x(), p.y(), p.z()}, static_cast<std::uint32_t>(vertices.size()));
                if (isNew) vertices.push_back(way.inBody(p));
                face[i] = at->second;
            }
            for (unsigned i = 0; i < 3; ++i) {
                const std::uint32_t u = face[i], v = face[(i + 1) % 3];
                if (u != v && edgeKnown.try_emplace({std::min(u, v), std::max(u, v)}, true).second)
                    edges.push_back({u, v});
            }
        }
    }
};

/// A vertex in the middle of a span of time, and its velocity at any time of it.
struct Moving {
    IVec middle, velocity;
};
using Moved = std::vector<Moving>;

struct Span {
    double from, to;
    [[nodiscard]] double middle() const { return 0.5 * (from + to); }
    [[nodiscard]] Interval whole() const { return {from, to}; }
    [[nodiscard]] Interval aboutMiddle() const { return whole() - Interval(middle()); }
};

struct Pair {
    std::uint32_t a, b;
};

/// Boxes that are apart save most of the work.
bool boxesMeet(const std::array<IVec, 3>& a, const std::array<IVec, 3>& b) {
    const auto meet = [&](const Interval IVec::*axis) {
        const Interval x = hull(hull(a[0].*axis, a[1].*axis), a[2].*axis),
                       y = hull(hull(b[0].*axis, b[1].*axis), b[2].*axis);
        return x.lower() <= y.upper() && y.lower() <= x.upper();
    };
    return meet(&IVec::x) && meet(&IVec::y) && meet(&IVec::z);
}

/// Strict: +1, -1; 0: not certain.
int sideOf(const IVec& p, const IVec& a, const IVec& b, const IVec& c) {
    const Interval volume = dot(cross(b - a, c - a), p - a);
    return volume.lower() > 0 ? 1 : volume.upper() < 0 ? -1 : 0;
}

bool pierces(const IVec& p, const IVec& q, const std::array<IVec, 3>& face) {
    const int above = sideOf(p, face[0], face[1], face[2]);
    if (above == 0 || sideOf(q, face[0], face[1], face[2]) != -above) return false;
    const int side = sideOf(q, p, face[0], face[1]);
    return side != 0 && sideOf(q, p, face[1], face[2]) == side && sideOf(q, p, face[2], face[0]) == side;
}

}  // namespace

struct MovingBodies::State {
    std::array<IntervalWay, 2> ways;
    std::array<Mesh, 2> meshes;

    State(const TriangleMesh& a, const BodyMotion& motionA, const TriangleMesh& b, const BodyMotion& motionB)
        : ways{IntervalWay(motionA), IntervalWay(motionB)}, meshes{Mesh(a, ways[0]), Mesh(b, ways[1])} {}

    /// All vertices of a body in the frame that `frame` carries along: its origin, and its rotation where it turns.
    [[nodiscard]] Moved moved(std::size_t body, std::size_t frame, const Span& span) const {
        const IntervalWay &way = ways[body], &carrier = ways[frame];
        struct Moment {
            IntervalWay::Rows rotation, back;
            IVec origin, scale;
            Moment(const IntervalWay& w, const IntervalWay& c, const Interval& t)
                : rotation(w.rotationAt(t)),
                  back(IntervalWay::transposed(c.rotationAt(t))),
                  origin(w.originAt(t, c)),
                  scale(w.scaleAt(t)) {}
        };
        const Moment middle(way, carrier, Interval(span.middle())), whole(way, carrier, span.whole());
        const bool own = body == frame;
        const auto mapped = [](const IntervalWay::Rows& m, const IVec& v) -> IVec {
            return {dot(m[0], v), dot(m[1], v), dot(m[2], v)};
        };
        const auto seen = [&](const Moment& m, const IVec& v) { return carrier.turns() ? mapped(m.back, v) : v; };
        const auto place = [&](const Moment& m, const IVec& v) -> IVec {
            const IVec scaled = times(m.scale, v);
            if (own && carrier.turns()) return scaled;
            return mapped(m.rotation, scaled) + m.origin;
        };
        Moved out;
        out.reserve(meshes[body].vertices.size());
        for (const IVec& v : meshes[body].vertices) {
            Moving& m = out.emplace_back();
            const IVec swelling = times(way.scaling(), v);
            if (own) {
                m.middle = place(middle, v);
                m.velocity = carrier.turns() ? swelling : mapped(whole.rotation, swelling);
                continue;
            }
            m.middle = seen(middle, place(middle, v));
            const IVec turned = mapped(whole.rotation, times(whole.scale, v));
            IVec velocity = mapped(whole.rotation, swelling) + way.drift(carrier);
            if (way.turns()) velocity = velocity + way.angle() * cross(way.axis(), turned);
            if (carrier.turns()) velocity = velocity - carrier.angle() * cross(carrier.axis(), turned + whole.origin);
            m.velocity = seen(whole, velocity);
        }
        return out;
    }

    [[nodiscard]] static bool parts(const Vec3d& direction, const std::array<const Moving*, 3>& a,
                                    const std::array<const Moving*, 3>& b, const Interval& about, double distance) {
        const double size = direction.cwiseAbs().maxCoeff();
        if (!(size > 0) || !std::isfinite(size)) return false;
        const Vec3d n = direction / size;
        double atLeast = 0;
        if (distance > 0) {
            const IVec exact(n);
            atLeast = (Interval(distance) * sqrt(dot(exact, exact))).upper();
        }
        for (const Moving* const p : a)
            for (const Moving* const q : b) {
                const Interval gap = dot(n, q->middle - p->middle) + about * dot(n, q->velocity - p->velocity);
                if (!(gap.lower() > atLeast)) return false;
            }
        return true;
    }

    /// Some direction parts the two faces at every moment of the span.
    [[nodiscard]] bool apart(const Pair& pair, const Moved& a, const Moved& b, const Interval& about,
                             double distance) const {
        std::array<const Moving*, 3> ofA, ofB;
        Corners x, y;
        for (std::size_t i = 0; i < 3; ++i) {
            ofA[i] = &a[meshes[0].faces[pair.a][i]];
            ofB[i] = &b[meshes[1].faces[pair.b][i]];
            x[i] = ofA[i]->middle.middle();
            y[i] = ofB[i]->middle.middle();
        }
        const auto holds = [&](const Vec3d& n) { return parts(n, ofA, ofB, about, distance); };
        const NearPoints near = nearPoints(x, y);
        if (holds(near.onB - near.onA)) return true;
        for (const Vec3d& n : separatingDirections(x, y))
            if (holds(n) || holds(-n)) return true;
        return false;
    }

    [[nodiscard]] std::vector<Pair> allPairs() const {
        std::vector<Pair> out;
        for (std::uint32_t i = 0; i < meshes[0].faces.size(); ++i)
            for (std::uint32_t j = 0; j < meshes[1].faces.size(); ++j) out.push_back({i, j});
        return out;
    }

    /// Where the first of ever shorter spans begins in which some pair could not be parted; nothing where all could.
    [[nodiscard]] std::optional<double> firstDoubt(std::vector<Pair> pairs, const Span& span, double distance,
                                                   std::size_t& spans) const {
        ++spans;
        const Interval about = span.aboutMiddle();
        for (std::size_t frame = 0; frame < 2; ++frame) {
            if (frame == 1 && !ways[1].turns() && !ways[0].turns()) break;
            const Moved a = moved(0, frame, span), b = moved(1, frame, span);
            std::erase_if(pairs, [&](const Pair& pair) { return apart(pair, a, b, about, distance); });
            if (pairs.empty()) return {};
        }
        if (span.to - span.from <= kShortest || spans > kMostSpans) return span.from;
        const double middle = span.middle();
        if (const auto before = firstDoubt(pairs, {span.from, middle}, distance, spans)) return before;
        return firstDoubt(std::move(pairs), {middle, span.to}, distance, spans);
    }

    [[nodiscard]] bool meet(double t) const {
        const Moved a = moved(0, 0, {t, t}), b = moved(1, 0, {t, t});
        for (std::size_t side = 0; side < 2; ++side) {
            const Moved &edged = side == 0 ? a : b, &faced = side == 0 ? b : a;
            for (const auto& edge : meshes[side].edges)
                for (const auto& face : meshes[1 - side].faces) {
                    const IVec &p = edged[edge[0]].middle, &q = edged[edge[1]].middle;
                    const std::array<IVec, 3> corners{faced[face[0]].middle, faced[face[1]].middle,
                                                      faced[face[2]].middle};
                    if (pierces(p, q, corners)) return true;
                }
        }
        return false;
    }
};

MovingBodies::MovingBodies(const TriangleMesh& a, const BodyMotion& motionA, const TriangleMesh& b,
                           const BodyMotion& motionB) {
    const Rounding rounding;
    state_ = std::make_unique<State>(a, motionA, b, motionB);
}
MovingBodies::~MovingBodies() = default;

bool MovingBodies::apart(double from, double to, double distance) const {
    const Rounding rounding;
    std::size_t spans = 0;
    return !state_->firstDoubt(state_->allPairs(), {from, to}, distance, spans);
}

bool MovingBodies::apart(double t, double distance) const {
    return apart(t, t, distance);
}

bool MovingBodies::meet(double t) const {
    const Rounding rounding;
    return state_->meet(t);
}

FirstContact MovingBodies::firstContact() const {
    const Rounding rounding;
    FirstContact out;
    std::size_t spans = 0;
    const std::optional<double> doubt = state_->firstDoubt(state_->allPairs(), {0, 1}, 0, spans);
    out.free = !doubt;
    out.freeUpTo = doubt.value_or(1);
    if (out.free) return out;
    std::vector<double> moments{out.freeUpTo, 1};
    for (int k = 50; k > 0; --k) moments.push_back(out.freeUpTo + std::ldexp(1, -k));
    for (int k = 1; k < 64; ++k) moments.push_back(k / 64.0);
    std::sort(moments.begin(), moments.end());
    for (const double t : moments) {
        if (t < out.freeUpTo || t > 1 || !state_->meet(t)) continue;
        double before = out.freeUpTo, after = t;
        for (int halving = 0; halving < 60 && before < after; ++halving) {
            const double middle = 0.5 * (before + after);
            if (middle == before || middle == after) break;
            (state_->meet(middle) ? after : before) = middle;
        }
        out.meetsAt = after;
        break;
    }
    return out;
}

std::vector<FacePair> MovingBodies::near(double t) const {
    const Rounding rounding;
    const Span span{t, t};
    const Moved a = state_->moved(0, 0, span), b = state_->moved(1, 0, span);
    std::vector<FacePair> out;
    for (const Pair& pair : state_->allPairs())
        if (!state_->apart(pair, a, b, span.aboutMiddle(), 0)) out.push_back({pair.a, pair.b});
    return out;
}

std::vector<FacePair> MovingBodies::pierced(double t, const Vec3d& normal, double overlap) const {
    const Rounding rounding;
    const Moved a = state_->moved(0, 0, {t, t}), b = state_->moved(1, 0, {t, t});
    const IntervalWay& carrier = state_->ways[0];
    const IntervalWay::Rows back = IntervalWay::transposed(carrier.rotationAt(Interval(0)));
    const IVec given(normal),
        n = carrier.turns() ? IVec{dot(back[0], given), dot(back[1], given), dot(back[2], given)} : given;
    const auto cornersOf = [](const Moved& moved, const std::array<std::uint32_t, 3>& face) -> std::array<IVec, 3> {
        return {moved[face[0]].middle, moved[face[1]].middle, moved[face[2]].middle};
    };
    const auto edgePierces = [](const std::array<IVec, 3>& edged, const std::array<IVec, 3>& faced) {
        return pierces(edged[0], edged[1], faced) || pierces(edged[1], edged[2], faced) ||
               pierces(edged[2], edged[0], faced);
    };
    std::vector<FacePair> out;
    for (const Pair& pair : state_->allPairs()) {
        const auto x = cornersOf(a, state_->meshes[0].faces[pair.a]), y = cornersOf(b, state_->meshes[1].faces[pair.b]);
        double highest = -std::numeric_limits<double>::infinity(), lowest = -highest;
        for (std::size_t i = 0; i < 3; ++i) {
            highest = std::max(highest, dot(n, x[i]).lower());
            lowest = std::min(lowest, dot(n, y[i]).upper());
        }
        if (highest - lowest > overlap && boxesMeet(x, y) && (edgePierces(x, y) || edgePierces(y, x)))
            out.push_back({pair.a, pair.b});
    }
    return out;
}

double MovingBodies::distanceAtMost(double t) const {
    const Rounding rounding;
    const Moved a = state_->moved(0, 0, {t, t}), b = state_->moved(1, 0, {t, t});
    double least = std::numeric_limits<double>::infinity();
    for (const auto& f : state_->meshes[0].faces)
        for (const auto& g : state_->meshes[1].faces) {
            Corners x, y;
            for (std::size_t i = 0; i < 3; ++i) {
                x[i] = a[f[i]].middle.middle();
                y[i] = b[g[i]].middle.middle();
            }
            const NearPoints near = nearPoints(x, y);
            if ((near.onB - near.onA).norm() > 2 * least) continue;
            // Weights that are exact, of corners that are certain: points of the faces.
            const auto blended = [](const Moved& moved, const std::array<std::uint32_t, 3>& face, const Weights& w) {
                const IVec& first = moved[face[0]].middle;
                return first + Interval(w.second) * (moved[face[1]].middle - first) +
                       Interval(w.third) * (moved[face[2]].middle - first);
            };
            const IVec way = blended(b, g, near.weightsB) - blended(a, f, near.weightsA);
            least = std::min(least, sqrt(dot(way, way)).upper());
        }
    return least;
}

}  // namespace tessera::truth
