#include "common/geometry/TangentSpace.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <unordered_map>
#include <utility>

namespace tessera {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;
/// Around a vertex: so many triangles are compared each with each. A group of more is taken as a whole.
constexpr std::size_t kMostCompared = 64;

struct Vec {
    float x = 0, y = 0, z = 0;
};
Vec operator+(const Vec& a, const Vec& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
Vec operator-(const Vec& a, const Vec& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
Vec operator*(float s, const Vec& v) {
    return {s * v.x, s * v.y, s * v.z};
}
float dot(const Vec& a, const Vec& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
bool same(const Vec& a, const Vec& b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
}
/// Of what is smaller no quotient is a normal number.
bool isAboveZero(float number) {
    return std::abs(number) > std::numeric_limits<float>::min();
}
Vec normalised(const Vec& v) {
    const float length = std::sqrt(dot(v, v));
    return isAboveZero(length) ? (1 / length) * v : v;
}
Vec across(const Vec& v, const Vec& normal) {
    return v - dot(normal, v) * normal;
}
Vec inPlane(const Vec& v, const Vec& normal) {
    return normalised(across(v, normal));
}
/// To 2e-8 (M. Abramowitz, I. Stegun, "Handbook of Mathematical Functions", 4.4.46): no two mathematical libraries give
/// the same bits, and hosts must.
float arcCosine(float x) {
    const float a = std::min(std::abs(x), 1.0f);
    float sum = -0.0012624911f;
    for (const float term :
         {0.0066700901f, -0.0170881256f, 0.0308918810f, -0.0501743046f, 0.0889789874f, -0.2145988016f, 1.5707963050f})
        sum = sum * a + term;
    const float angle = std::sqrt(1 - a) * sum;
    return x < 0 ? std::numbers::pi_v<float> - angle : angle;
}

/// Triangle by triangle; corners are numbered 3 * triangle + 0 to 2.
class TangentMaker {
public:
    explicit TangentMaker(const TangentSource& mesh)
        : mesh_(mesh), corners_(mesh.indices.size() / 3 * 3), triangles_(corners_ / 3) {}

    CornerTangents make() {
        weld();
        look();
        findNeighbours();
        group();
        CornerTangents out;
        out.ofCorner.assign(mesh_.indices.size(), 0);
        // The first stands for all that have none.
        out.tangents.push_back({0, 0, 0, 1});
        for (std::size_t g = 0; g + 1 < firstMember_.size(); ++g) tell(g, out);
        takeFromElsewhere(out);
        return out;
    }

private:
    struct Triangle {
        Vec alongU, alongV;  ///< of length 1, or 0
        bool degenerate = false;
        bool keepsOrientation = false;  ///< the image is not mirrored on it
        bool joinsAny = true;           ///< the image gives no direction
    };

    [[nodiscard]] Vec at(std::span<const float> values, std::uint32_t vertex) const {
        const std::size_t i = std::size_t{3} * vertex;
        return {values[i], values[i + 1], values[i + 2]};
    }
    [[nodiscard]] Vec position(std::size_t corner) const { return at(mesh_.positions, vertexOf_[corner]); }

    /// What makes a vertex, zeros without a sign.
    [[nodiscard]] std::array<std::uint32_t, 8> contentOf(std::uint32_t vertex) const {
        std::array<std::uint32_t, 8> content{};
        for (std::size_t k = 0; k < 3; ++k) {
            content[k] = std::bit_cast<std::uint32_t>(mesh_.positions[std::size_t{3} * vertex + k] + 0.0f);
            content[3 + k] = std::bit_cast<std::uint32_t>(mesh_.normals[std::size_t{3} * vertex + k] + 0.0f);
        }
        for (std::size_t k = 0; k < 2; ++k)
            content[6 + k] = std::bit_cast<std::uint32_t>(mesh_.texcoords[std::size_t{2} * vertex + k] + 0.0f);
        return content;
    }

    /// Each corner's vertex: the first one of equal content.
    void weld() {
        const std::size_t vertices = mesh_.positions.size() / 3;
        std::vector<std::uint32_t> first(vertices, kNone);
        std::vector<std::uint32_t> table(std::bit_ceil(std::max<std::size_t>(16, 2 * vertices)), kNone);
        const std::size_t mask = table.size() - 1;
        vertexOf_.resize(corners_);
        for (std::size_t corner = 0; corner < corners_; ++corner) {
            const std::uint32_t vertex = mesh_.indices[corner];
            if (first[vertex] == kNone) {
                const auto content = contentOf(vertex);
                std::uint64_t hash = 0;
                for (const std::uint32_t word : content)
                    hash = (hash ^ word) * 0x9E3779B97F4A7C15ull, hash ^= hash >> 29;
                std::size_t place = hash & mask;
                while (table[place] != kNone && contentOf(table[place]) != content) place = (place + 1) & mask;
                if (table[place] == kNone) table[place] = vertex;
                first[vertex] = table[place];
            }
            vertexOf_[corner] = first[vertex];
        }
    }

    void look() {
        triangle_.resize(triangles_);
        for (std::size_t t = 0; t < triangles_; ++t) {
            Triangle& triangle = triangle_[t];
            const Vec p0 = position(3 * t), p1 = position(3 * t + 1), p2 = position(3 * t + 2);
            triangle.degenerate = same(p0, p1) || same(p0, p2) || same(p1, p2);
            if (triangle.degenerate) continue;
            const auto uv = [&](std::size_t corner, std::size_t k) {
                return mesh_.texcoords[std::size_t{2} * vertexOf_[3 * t + corner] + k];
            };
            const float u1 = uv(1, 0) - uv(0, 0), v1 = uv(1, 1) - uv(0, 1), u2 = uv(2, 0) - uv(0, 0),
                        v2 = uv(2, 1) - uv(0, 1);
            const float area = u1 * v2 - v1 * u2;
            triangle.keepsOrientation = area > 0;
            if (!isAboveZero(area)) continue;
            const Vec d1 = p1 - p0, d2 = p2 - p0;
            const Vec u = v2 * d1 - v1 * d2, v = u1 * d2 - u2 * d1;
            const float lengthU = std::sqrt(dot(u, u)), lengthV = std::sqrt(dot(v, v)), sign = area > 0 ? 1.0f : -1.0f;
            if (isAboveZero(lengthU)) triangle.alongU = (sign / lengthU) * u;
            if (isAboveZero(lengthV)) triangle.alongV = (sign / lengthV) * v;
            triangle.joinsAny = !(isAboveZero(lengthU / std::abs(area)) && isAboveZero(lengthV / std::abs(area)));
        }
    }

    /// Edge k of a triangle goes from its corner k to the next. Triangles are neighbours where they go along an edge in
    /// opposite directions; where many do, the first one in each direction is the other's.
    void findNeighbours() {
        struct Edge {
            std::uint32_t other, corner;
            bool upwards;
        };
        const std::size_t vertices = mesh_.positions.size() / 3;
        const auto ends = [this](std::size_t corner) {
            const std::size_t next = corner % 3 == 2 ? corner - 2 : corner + 1;
            return std::pair(vertexOf_[corner], vertexOf_[next]);
        };
        // By the lower of their vertices.
        std::vector<std::uint32_t> firstEdge(vertices + 1, 0);
        const auto eachEdge = [&](auto&& use) {
            for (std::size_t corner = 0; corner < corners_; ++corner)
                if (!triangle_[corner / 3].degenerate) use(corner);
        };
        eachEdge([&](std::size_t corner) {
            const auto [a, b] = ends(corner);
            ++firstEdge[std::min(a, b) + 1];
        });
        for (std::size_t v = 0; v < vertices; ++v) firstEdge[v + 1] += firstEdge[v];
        std::vector<Edge> edges(firstEdge[vertices]);
        std::vector<std::uint32_t> filled(firstEdge.begin(), firstEdge.end() - 1);
        eachEdge([&](std::size_t corner) {
            const auto [a, b] = ends(corner);
            edges[filled[std::min(a, b)]++] = {std::max(a, b), static_cast<std::uint32_t>(corner), a < b};
        });
        neighbour_.assign(corners_, kNone);
        for (std::size_t v = 0; v < vertices; ++v) {
            const auto begin = edges.begin() + firstEdge[v], end = edges.begin() + firstEdge[v + 1];
            std::sort(begin, end, [](const Edge& a, const Edge& b) {
                return std::pair(a.other, a.corner) < std::pair(b.other, b.corner);
            });
            // Who waits for a neighbour, the longest first: all in one direction.
            auto waiting = begin, waitingEnd = begin;
            std::uint32_t other = kNone;
            for (auto edge = begin; edge != end; ++edge) {
                if (edge->other != other) waiting = waitingEnd = edge;
                other = edge->other;
                if (waiting == waitingEnd || waiting->upwards == edge->upwards) {
                    *waitingEnd++ = *edge;
                    continue;
                }
                neighbour_[waiting->corner] = edge->corner / 3;
                neighbour_[edge->corner] = waiting->corner / 3;
                ++waiting;
            }
        }
    }

    /// A group for each corner that has none, in the order of the corners: it decides which way round a triangle goes
    /// that the image gives no direction.
    void group() {
        groupOf_.assign(corners_, kNone);
        std::vector<std::uint32_t> next;
        for (std::size_t corner = 0; corner < corners_; ++corner) {
            const std::size_t t = corner / 3;
            if (triangle_[t].degenerate || triangle_[t].joinsAny || groupOf_[corner] != kNone) continue;
            const auto number = static_cast<std::uint32_t>(firstMember_.size());
            const bool keeps = triangle_[t].keepsOrientation;
            firstMember_.push_back(members_.size());
            const std::uint32_t vertex = vertexOf_[corner];
            const auto add = [&](std::size_t member) {
                groupOf_[member] = number;
                members_.push_back(static_cast<std::uint32_t>(member));
                // Of its two neighbours at this vertex the one ahead comes first, with all behind it.
                next.push_back(neighbour_[member % 3 == 0 ? member + 2 : member - 1]);
                next.push_back(neighbour_[member]);
            };
            add(corner);
            while (!next.empty()) {
                const std::uint32_t reached = next.back();
                next.pop_back();
                if (reached == kNone) continue;
                Triangle& triangle = triangle_[reached];
                std::size_t member = 3 * std::size_t{reached};
                while (vertexOf_[member] != vertex) ++member;
                if (groupOf_[member] != kNone) continue;
                const auto* const groups = &groupOf_[3 * std::size_t{reached}];
                if (triangle.joinsAny && std::all_of(groups, groups + 3, [](std::uint32_t g) { return g == kNone; }))
                    triangle.keepsOrientation = keeps;
                if (triangle.keepsOrientation == keeps) add(member);
            }
            std::sort(members_.begin() + static_cast<std::ptrdiff_t>(firstMember_.back()), members_.end());
        }
        firstMember_.push_back(members_.size());
    }

    [[nodiscard]] Vec normalAt(std::size_t corner) const { return at(mesh_.normals, vertexOf_[corner]); }

    /// The mean of some members of a group.
    [[nodiscard]] Vec meanOf(std::span<const std::uint32_t> members) const {
        Vec sum;
        for (const std::uint32_t member : members) {
            const Triangle& triangle = triangle_[member / 3];
            if (triangle.joinsAny) continue;
            const std::size_t ahead = member % 3 == 2 ? member - 2 : member + 1,
                              behind = member % 3 == 0 ? member + 2 : member - 1;
            const Vec n = normalAt(member), p = position(member), a = across(position(behind) - p, n),
                      b = across(position(ahead) - p, n);
            const float lengths = std::sqrt(dot(a, a)) * std::sqrt(dot(b, b));
            const float cosine = isAboveZero(lengths) ? dot(a, b) / lengths : 0.0f;
            sum = sum + arcCosine(cosine) * inPlane(triangle.alongU, n);
        }
        return normalised(sum);
    }

    /// Triangles whose directions are exactly opposite do not go into one mean.
    [[nodiscard]] bool areApart(std::uint32_t a, std::uint32_t b) const {
        const Triangle &one = triangle_[a / 3], &other = triangle_[b / 3];
        if (one.joinsAny || other.joinsAny || a / 3 == b / 3) return false;
        const Vec n = normalAt(a);
        return !(dot(inPlane(one.alongU, n), inPlane(other.alongU, n)) > -1 &&
                 dot(inPlane(one.alongV, n), inPlane(other.alongV, n)) > -1);
    }

    /// Whether all point to one side, clearly, so that no two are opposite: as it nearly always is.
    [[nodiscard]] bool allAgree(std::span<const std::uint32_t> members) const {
        constexpr float kClearly = 0.01f;
        const Triangle& first = triangle_[members.front() / 3];
        const Vec n = normalAt(members.front()), u = inPlane(first.alongU, n), v = inPlane(first.alongV, n);
        return std::ranges::all_of(members, [&](std::uint32_t member) {
            const Triangle& triangle = triangle_[member / 3];
            return triangle.joinsAny || (dot(u, triangle.alongU) > kClearly && dot(v, triangle.alongV) > kClearly);
        });
    }

    void tell(std::size_t group, CornerTangents& out) const {
        const std::span<const std::uint32_t> members =
            std::span(members_).subspan(firstMember_[group], firstMember_[group + 1] - firstMember_[group]);
        // Ours goes against v, as v goes down; the algorithm's goes along.
        const float sign = triangle_[members.front() / 3].keepsOrientation ? -1.0f : 1.0f;
        const auto add = [&](std::span<const std::uint32_t> of) {
            const Vec mean = meanOf(of);
            const bool sound = std::isfinite(mean.x) && std::isfinite(mean.y) && std::isfinite(mean.z);
            out.tangents.push_back(sound ? std::array{mean.x, mean.y, mean.z, sign}
                                         : std::array{0.0f, 0.0f, 0.0f, sign});
            return static_cast<std::uint32_t>(out.tangents.size() - 1);
        };
        if (members.size() > kMostCompared || allAgree(members)) {
            const std::uint32_t all = add(members);
            for (const std::uint32_t member : members) out.ofCorner[member] = all;
            return;
        }
        std::vector<std::pair<std::vector<std::uint32_t>, std::uint32_t>> told;
        for (const std::uint32_t member : members) {
            std::vector<std::uint32_t> with;
            for (const std::uint32_t other : members)
                if (!areApart(member, other)) with.push_back(other);
            auto known = std::ranges::find(told, with, &std::pair<std::vector<std::uint32_t>, std::uint32_t>::first);
            if (known == told.end()) {
                const std::uint32_t tangent = add(with);
                known = told.insert(told.end(), {std::move(with), tangent});
            }
            out.ofCorner[member] = known->second;
        }
    }

    /// Corners of triangles that are none.
    void takeFromElsewhere(CornerTangents& out) const {
        if (std::ranges::none_of(triangle_, &Triangle::degenerate)) return;
        std::vector<std::uint32_t> first(mesh_.positions.size() / 3, kNone);
        for (std::size_t corner = corners_; corner-- > 0;)
            if (!triangle_[corner / 3].degenerate) first[vertexOf_[corner]] = static_cast<std::uint32_t>(corner);
        for (std::size_t corner = 0; corner < corners_; ++corner)
            if (triangle_[corner / 3].degenerate && first[vertexOf_[corner]] != kNone)
                out.ofCorner[corner] = out.ofCorner[first[vertexOf_[corner]]];
    }

    const TangentSource& mesh_;
    std::size_t corners_, triangles_;
    std::vector<std::uint32_t> vertexOf_;  ///< of corners
    std::vector<Triangle> triangle_;
    std::vector<std::uint32_t> neighbour_;  ///< of corners: the triangle beyond the edge that begins there
    std::vector<std::uint32_t> groupOf_;    ///< of corners
    std::vector<std::size_t> firstMember_;  ///< of groups, into members_
    std::vector<std::uint32_t> members_;    ///< corners
};

}  // namespace

CornerTangents mikkTangents(const TangentSource& mesh) {
    return TangentMaker(mesh).make();
}

VertexTangents mikkVertexTangents(const TangentSource& mesh) {
    const CornerTangents corners = mikkTangents(mesh);
    std::vector<std::uint32_t> tangentOf(mesh.positions.size() / 3, kNone);
    VertexTangents out;
    out.indices.assign(mesh.indices.begin(), mesh.indices.end());
    std::unordered_map<std::uint64_t, std::uint32_t> further;  // by vertex and tangent
    for (std::size_t corner = 0; corner < out.indices.size(); ++corner) {
        const std::uint32_t vertex = out.indices[corner], tangent = corners.ofCorner[corner];
        if (tangentOf[vertex] == kNone) tangentOf[vertex] = tangent;
        if (corners.tangents[tangentOf[vertex]] == corners.tangents[tangent]) continue;
        const auto next = static_cast<std::uint32_t>(tangentOf.size());
        const auto [known, isNew] = further.try_emplace(std::uint64_t{vertex} << 32 | tangent, next);
        if (isNew) {
            tangentOf.push_back(tangent);
            out.copied.push_back(vertex);
        }
        out.indices[corner] = known->second;
    }
    out.tangents.reserve(4 * tangentOf.size());
    for (const std::uint32_t tangent : tangentOf) {
        const std::array<float, 4>& value = corners.tangents[tangent == kNone ? 0 : tangent];
        out.tangents.insert(out.tangents.end(), value.begin(), value.end());
    }
    return out;
}

}  // namespace tessera
