#include "common/freeform/nurbs/tessellation/CellTriangulation.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <tuple>
#include <utility>

namespace tessera {
namespace {

int after(int i) {
    return i == 2 ? 0 : i + 1;
}
int before(int i) {
    return i == 0 ? 2 : i - 1;
}

}  // namespace

CellTriangulation::CellTriangulation(std::span<const LatticePoint> rim, PlaceOf placeOf)
    : placeOf_(std::move(placeOf)) {
    std::vector<std::uint32_t> order;
    for (const LatticePoint& p : rim) {
        if (known_.contains(p)) sound_ = false;
        order.push_back(add(p));
    }
    if (order.size() < 3) sound_ = false;
    if (sound_) triangulateRim(std::move(order));
    if (sound_) joinNeighbours();
}

std::uint32_t CellTriangulation::add(const LatticePoint& p) {
    const auto index = static_cast<std::uint32_t>(points_.size());
    points_.push_back(p);
    places_.push_back(placeOf_(p));
    triangleOf_.push_back(kNone);
    known_.emplace(p, index);
    return index;
}

double CellTriangulation::roundness(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    const Vec3d ab = places_[b] - places_[a], ac = places_[c] - places_[a], bc = places_[c] - places_[b];
    // What is collapsed at a pole is not drawn: nothing to be round.
    if (ab.isZero(0) || ac.isZero(0) || bc.isZero(0)) return 1;
    const double sum = ab.squaredNorm() + ac.squaredNorm() + bc.squaredNorm();
    return 2 * std::sqrt(3.0) * ab.cross(ac).norm() / sum;
}

void CellTriangulation::triangulateRim(std::vector<std::uint32_t> rim) {
    bool convex = true;
    for (std::size_t i = 0; i < rim.size(); ++i)
        convex = convex && turn(rim[i], rim[(i + 1) % rim.size()], rim[(i + 2) % rim.size()]) >= 0;
    while (rim.size() > 3) {
        const std::size_t n = rim.size();
        std::size_t best = n;
        double shortest = 0;
        for (std::size_t i = 0; i < n; ++i) {
            const std::uint32_t a = rim[(i + n - 1) % n], b = rim[i], c = rim[(i + 1) % n];
            if (turn(a, b, c) <= 0) continue;
            const double length = (places_[c] - places_[a]).squaredNorm();
            if (best < n && !(length < shortest)) continue;
            // What is left needs an area: some turn among the others. And nothing may be within the ear.
            bool leaves = false, empty = true;
            for (std::size_t k = 1; k + 2 < n && !leaves; ++k)
                leaves = turn(rim[(i + k) % n], rim[(i + k + 1) % n], a) != 0;
            for (std::size_t k = 2; !convex && empty && k < n - 1; ++k) {
                const std::uint32_t p = rim[(i + k) % n];
                empty = turn(a, b, p) < 0 || turn(b, c, p) < 0 || turn(c, a, p) < 0;
            }
            if (!leaves || !empty) continue;
            best = i;
            shortest = length;
        }
        if (best == n) {
            sound_ = false;
            return;
        }
        triangles_.push_back({.corner = {rim[(best + n - 1) % n], rim[best], rim[(best + 1) % n]}});
        rim.erase(rim.begin() + static_cast<std::ptrdiff_t>(best));
    }
    if (turn(rim[0], rim[1], rim[2]) <= 0) sound_ = false;
    triangles_.push_back({.corner = {rim[0], rim[1], rim[2]}});
}

void CellTriangulation::joinNeighbours() {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::pair<std::uint32_t, int>> edges;
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
        for (int i = 0; i < 3; ++i) {
            const auto& corner = triangles_[t].corner;
            triangleOf_[corner[static_cast<std::size_t>(i)]] = t;
            edges[{corner[static_cast<std::size_t>(after(i))], corner[static_cast<std::size_t>(before(i))]}] = {t, i};
        }
    for (const auto& [edge, at] : edges) {
        const auto other = edges.find({edge.second, edge.first});
        if (other != edges.end())
            triangles_[at.first].across[static_cast<std::size_t>(at.second)] = other->second.first;
    }
}

void CellTriangulation::retarget(std::uint32_t t, std::uint32_t from, std::uint32_t to) {
    if (t == kNone) return;
    for (std::uint32_t& across : triangles_[t].across)
        if (across == from) {
            across = to;
            return;
        }
}

std::uint32_t CellTriangulation::find(const LatticePoint& p) const {
    const auto outside = [&](const Triangle& t, int i) {
        return turnOf(points_[t.corner[static_cast<std::size_t>(after(i))]],
                      points_[t.corner[static_cast<std::size_t>(before(i))]], p) < 0;
    };
    // A walk towards it; where that goes in a circle, all of them.
    std::uint32_t at = static_cast<std::uint32_t>(triangles_.size()) - 1;
    for (std::size_t steps = 0; steps < triangles_.size(); ++steps) {
        const Triangle& t = triangles_[at];
        std::uint32_t next = at;
        for (int i = 0; i < 3 && next == at; ++i)
            if (outside(t, i)) next = t.across[static_cast<std::size_t>(i)];
        if (next == at) return at;
        if (next == kNone) break;
        at = next;
    }
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
        if (!outside(triangles_[t], 0) && !outside(triangles_[t], 1) && !outside(triangles_[t], 2)) return t;
    return kNone;
}

std::uint32_t CellTriangulation::insert(const LatticePoint& p) {
    if (const auto known = known_.find(p); known != known_.end()) return known->second;
    const std::uint32_t t = find(p);
    if (t == kNone) {
        sound_ = false;
        return kNone;
    }
    int edge = -1;
    for (int i = 0; i < 3; ++i) {
        const auto& corner = triangles_[t].corner;
        if (turnOf(points_[corner[static_cast<std::size_t>(after(i))]],
                   points_[corner[static_cast<std::size_t>(before(i))]], p) == 0)
            edge = i;
    }
    const std::uint32_t made = add(p);
    if (edge < 0) {
        splitInside(t, made);
    } else if (triangles_[t].across[static_cast<std::size_t>(edge)] == kNone) {
        sound_ = false;  // the rim's vertices are given: a neighbour would not know of this one
    } else {
        splitEdge(t, edge, made);
    }
    return made;
}

void CellTriangulation::splitInside(std::uint32_t t, std::uint32_t p) {
    const Triangle old = triangles_[t];
    const auto n = static_cast<std::uint32_t>(triangles_.size());
    const std::array<std::uint32_t, 3> made = {t, n, n + 1};
    triangles_.resize(n + 2);
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t a = (i + 1) % 3, b = (i + 2) % 3;
        // Opposite of p: the old edge. Opposite of corner a: the edge from b to p, shared with the part that lies along
        // the edge opposite of a.
        triangles_[made[i]] = {.corner = {p, old.corner[a], old.corner[b]},
                               .across = {old.across[i], made[a], made[b]},
                               .side = {old.side[i], kNoTrim, kNoTrim}};
        retarget(old.across[i], t, made[i]);
        triangleOf_[old.corner[a]] = made[i];
    }
    triangleOf_[p] = t;
}

void CellTriangulation::splitEdge(std::uint32_t t, int edge, std::uint32_t p) {
    // Into a triangle of no area first, then that one is flipped away: both ways share their bookkeeping.
    const auto e = static_cast<std::size_t>(edge);
    const std::uint32_t a = triangles_[t].corner[(e + 1) % 3], b = triangles_[t].corner[(e + 2) % 3];
    const Side side = triangles_[t].side[e];
    mark(t, edge, kNoTrim);
    splitInside(t, p);
    const auto [flat, flatEdge] = edgeOf(a, b);
    flip(flat, flatEdge);
    if (side == kNoTrim) return;
    const auto [first, firstEdge] = edgeOf(a, p);
    mark(first, firstEdge, side);
    const auto [second, secondEdge] = edgeOf(p, b);
    mark(second, secondEdge, side);
}

std::vector<std::uint32_t> CellTriangulation::around(std::uint32_t vertex) const {
    std::vector<std::uint32_t> found;
    const std::uint32_t first = triangleOf_[vertex];
    for (const bool forwards : {true, false}) {
        std::uint32_t t = first;
        while (t != kNone) {
            if (forwards || t != first) found.push_back(t);
            const auto& corner = triangles_[t].corner;
            const int i = static_cast<int>(std::find(corner.begin(), corner.end(), vertex) - corner.begin());
            t = triangles_[t].across[static_cast<std::size_t>(forwards ? after(i) : before(i))];
            if (t == first) return found;
        }
    }
    return found;
}

std::pair<std::uint32_t, int> CellTriangulation::edgeOf(std::uint32_t a, std::uint32_t b) const {
    for (const std::uint32_t t : around(a))
        for (int i = 0; i < 3; ++i)
            if (triangles_[t].corner[static_cast<std::size_t>(after(i))] == a &&
                triangles_[t].corner[static_cast<std::size_t>(before(i))] == b)
                return {t, i};
    return {kNone, 0};
}

void CellTriangulation::mark(std::uint32_t t, int edge, Side side) {
    const auto e = static_cast<std::size_t>(edge);
    triangles_[t].side[e] = side;
    const std::uint32_t beyond = triangles_[t].across[e];
    if (beyond == kNone) return;
    for (std::size_t i = 0; i < 3; ++i)
        if (triangles_[beyond].across[i] == t) triangles_[beyond].side[i] = static_cast<Side>(-side);
}

bool CellTriangulation::canFlip(std::uint32_t t, int edge) const {
    const auto e = static_cast<std::size_t>(edge);
    const Triangle& here = triangles_[t];
    if (here.across[e] == kNone || here.side[e] != kNoTrim) return false;
    const Triangle& there = triangles_[here.across[e]];
    const auto i =
        static_cast<std::size_t>(std::find(there.across.begin(), there.across.end(), t) - there.across.begin());
    const std::uint32_t p = here.corner[e], a = here.corner[(e + 1) % 3], q = there.corner[i],
                        b = here.corner[(e + 2) % 3];
    return turn(p, a, q) > 0 && turn(q, b, p) > 0;
}

void CellTriangulation::flip(std::uint32_t t, int edge) {
    const auto e = static_cast<std::size_t>(edge);
    const std::uint32_t n = triangles_[t].across[e];
    const Triangle here = triangles_[t], there = triangles_[n];
    const auto i =
        static_cast<std::size_t>(std::find(there.across.begin(), there.across.end(), t) - there.across.begin());
    const std::uint32_t p = here.corner[e], a = here.corner[(e + 1) % 3], b = here.corner[(e + 2) % 3],
                        q = there.corner[i];
    // `here` is p a b, `there` q b a; then p a q and q b p.
    const std::size_t pb = (e + 1) % 3, pa = (e + 2) % 3, qa = (i + 1) % 3, qb = (i + 2) % 3;
    triangles_[t] = {.corner = {p, a, q},
                     .across = {there.across[qa], n, here.across[pa]},
                     .side = {there.side[qa], kNoTrim, here.side[pa]}};
    triangles_[n] = {.corner = {q, b, p},
                     .across = {here.across[pb], t, there.across[qb]},
                     .side = {here.side[pb], kNoTrim, there.side[qb]}};
    retarget(there.across[qa], n, t);
    retarget(here.across[pb], t, n);
    triangleOf_[p] = triangleOf_[a] = triangleOf_[q] = t;
    triangleOf_[b] = n;
}

void CellTriangulation::trim(const LatticePoint& from, const LatticePoint& to) {
    if (!sound_) return;
    const std::uint32_t a = insert(from);
    if (!sound_) return;
    const std::uint32_t b = insert(to);
    if (sound_ && a != b) connect(a, b);
}

void CellTriangulation::connect(std::uint32_t a, std::uint32_t b) {
    while (sound_ && a != b) {
        // The triangle through which the way leaves a, or the vertex that it meets first.
        std::uint32_t target = b, begin = kNone;
        for (const std::uint32_t t : around(a)) {
            const auto& corner = triangles_[t].corner;
            const auto i = static_cast<std::size_t>(std::find(corner.begin(), corner.end(), a) - corner.begin());
            for (const std::uint32_t p : {corner[(i + 1) % 3], corner[(i + 2) % 3]})
                if (turn(a, b, p) == 0 && (p == b || isBetween(points_[p], points_[a], points_[b])))
                    target = p, begin = kNone - 1;
            if (begin == kNone && turn(a, b, corner[(i + 1) % 3]) < 0 && turn(a, b, corner[(i + 2) % 3]) > 0) begin = t;
        }
        if (begin == kNone) {
            sound_ = false;
            return;
        }
        if (begin != kNone - 1) {
            std::deque<std::pair<std::uint32_t, std::uint32_t>> crossed;
            std::uint32_t t = begin;
            const auto& first = triangles_[t].corner;
            auto i = static_cast<std::size_t>(std::find(first.begin(), first.end(), a) - first.begin());
            // Over each edge, right end first, until the way meets a vertex.
            while (true) {
                if (triangles_[t].side[i] != kNoTrim || triangles_[t].across[i] == kNone) {
                    sound_ = false;
                    return;
                }
                const std::uint32_t right = triangles_[t].corner[(i + 1) % 3], left = triangles_[t].corner[(i + 2) % 3];
                crossed.emplace_back(right, left);
                t = triangles_[t].across[i];
                const auto& corner = triangles_[t].corner;
                const auto l = static_cast<std::size_t>(std::find(corner.begin(), corner.end(), left) - corner.begin());
                const std::uint32_t tip = corner[(l + 2) % 3];  // counterclockwise: left, right, tip
                const int side = turn(a, b, tip);
                if (side == 0) {
                    target = tip;
                    break;
                }
                i = side > 0 ? l : (l + 1) % 3;
            }
            std::size_t left = 64 * crossed.size() * crossed.size() + 64;
            while (!crossed.empty()) {
                if (left-- == 0) {
                    sound_ = false;
                    return;
                }
                const auto [p, q] = crossed.front();
                crossed.pop_front();
                const auto [at, edge] = edgeOf(p, q);
                if (!canFlip(at, edge)) {
                    crossed.emplace_back(p, q);
                    continue;
                }
                flip(at, edge);
                const std::uint32_t r = triangles_[at].corner[0], s = triangles_[at].corner[2];
                const int sideR = turn(a, target, r), sideS = turn(a, target, s);
                if (sideR < 0 && sideS > 0) crossed.emplace_back(r, s);
                if (sideR > 0 && sideS < 0) crossed.emplace_back(s, r);
            }
        }
        auto [t, edge] = edgeOf(a, target);
        Side side = kOn;
        if (t == kNone) {
            std::tie(t, edge) = edgeOf(target, a);
            side = kOff;
        }
        if (t == kNone || triangles_[t].side[static_cast<std::size_t>(edge)] == -side) {
            sound_ = false;
            return;
        }
        mark(t, edge, side);
        a = target;
    }
}

void CellTriangulation::improve() {
    if (!sound_) return;
    constexpr int kRounds = 6;
    for (int round = 0; round < kRounds; ++round) {
        bool flipped = false;
        for (std::uint32_t t = 0; t < triangles_.size(); ++t)
            for (int edge = 0; edge < 3; ++edge) {
                if (!canFlip(t, edge)) continue;
                const auto e = static_cast<std::size_t>(edge);
                const Triangle &here = triangles_[t], &there = triangles_[here.across[e]];
                const auto i = static_cast<std::size_t>(std::find(there.across.begin(), there.across.end(), t) -
                                                        there.across.begin());
                const std::uint32_t p = here.corner[e], a = here.corner[(e + 1) % 3], b = here.corner[(e + 2) % 3],
                                    q = there.corner[i];
                if (std::min(roundness(p, a, q), roundness(q, b, p)) >
                    1.0001 * std::min(roundness(p, a, b), roundness(q, b, a))) {
                    flip(t, edge);
                    flipped = true;
                }
            }
        if (!flipped) break;
    }
}

std::vector<std::array<LatticePoint, 3>> CellTriangulation::kept(bool whereNoTrims) {
    std::vector<std::array<LatticePoint, 3>> result;
    if (!sound_) return result;
    std::vector<Side> side(triangles_.size(), kNoTrim);
    std::vector<std::uint32_t> open;
    const auto tell = [&](std::uint32_t t, Side s) {
        if (side[t] == -s) sound_ = false;
        if (side[t] != kNoTrim) return;
        side[t] = s;
        open.push_back(t);
    };
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
        for (const Side s : triangles_[t].side)
            if (s != kNoTrim) tell(t, s);
    while (!open.empty()) {
        const std::uint32_t t = open.back();
        open.pop_back();
        for (std::size_t i = 0; i < 3; ++i)
            if (triangles_[t].side[i] == kNoTrim && triangles_[t].across[i] != kNone)
                tell(triangles_[t].across[i], side[t]);
    }
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
        const auto& corner = triangles_[t].corner;
        if (side[t] == kOn || (side[t] == kNoTrim && whereNoTrims))
            result.push_back({points_[corner[0]], points_[corner[1]], points_[corner[2]]});
    }
    return result;
}

}  // namespace tessera
