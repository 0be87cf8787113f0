#include "server/import/reader/SmoothNormals.h"
#include "server/import/reader/PlaceTable.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

namespace tessera {
namespace {

/// Zero where it has no area.
Vec3f normalOrZero(const float* a, const float* b, const float* c) {
    const Vec3d origin(a[0], a[1], a[2]);
    const Vec3d normal = (Vec3d(b[0], b[1], b[2]) - origin).cross(Vec3d(c[0], c[1], c[2]) - origin);
    const double length = normal.norm();
    return length > 0 && std::isfinite(length) ? Vec3f((normal * (1 / length)).cast<float>()) : Vec3f(Vec3f::Zero());
}

/// Of a cosine, in radians, to 7e-5: Abramowitz and Stegun, Handbook of Mathematical Functions, 4.4.45.
float arcCosine(float cosine) {
    const float x = std::min(std::abs(cosine), 1.0f);
    const float angle = std::sqrt(1 - x) * (((-0.0187293f * x + 0.0742610f) * x - 0.2121144f) * x + 1.5707288f);
    return cosine < 0 ? std::numbers::pi_v<float> - angle : angle;
}

/// For each vertex the number of its place. `expected`: how many places there are likely to be.
std::vector<std::uint32_t> placesOf(std::span<const float> positions, std::size_t expected, std::uint32_t& count) {
    PlaceTable table;
    table.reserve(expected);
    std::vector<std::uint32_t> places(positions.size() / 3);
    for (std::size_t v = 0; v < places.size(); ++v) places[v] = table.numberOf(&positions[3 * v]);
    count = table.size();
    return places;
}

template <typename Number>
void repeat(std::vector<Number>& values, std::size_t each, std::size_t vertices, std::uint32_t vertex) {
    if (values.size() < each * vertices || values.empty()) return;
    for (std::size_t i = 0; i < each; ++i) values.push_back(Number(values[each * vertex + i]));
}

/// What its corners need of a triangle: 16 bytes, as there may be very many.
struct Facet {
    Vec3f normal = Vec3f::Zero();  ///< unit, or zero where it has no area
    std::uint32_t angles = 0;      ///< ten bits for each corner, of half a turn; one at least

    Facet() = default;
    Facet(const float* a, const float* b, const float* c) : normal(normalOrZero(a, b, c)) {
        const Vec3f one = sideOf(a, b), two = sideOf(b, c), three = sideOf(c, a);
        const float atA = arcCosine(-one.dot(three)), atB = arcCosine(-one.dot(two));
        std::size_t corner = 0;
        for (const float angle : {atA, atB, std::numbers::pi_v<float> - atA - atB}) {
            constexpr float kSteps = 1023;
            // What is no number compares with none.
            const float steps = std::min(kSteps, std::max(1.0f, angle / std::numbers::pi_v<float> * kSteps + 0.5f));
            angles |= static_cast<std::uint32_t>(steps) << 10 * corner++;
        }
    }
    /// Of length 1.
    static Vec3f sideOf(const float* from, const float* to) {
        const Vec3f side = Vec3f(to[0], to[1], to[2]) - Vec3f(from[0], from[1], from[2]);
        return side * (1 / side.norm());
    }
    [[nodiscard]] Vec3f weighed(std::size_t corner) const {
        return normal * static_cast<float>(angles >> 10 * corner & 1023);
    }
};
static_assert(sizeof(Facet) == 16);

/// Gives the corners of one place after the other their normals.
class NormalSplit {
public:
    NormalSplit(MeshData& mesh, double creaseAngle)
        : mesh_(mesh),
          smoothest_(static_cast<float>(std::min(std::cos(creaseAngle), kOwn))),
          allNear_(static_cast<float>(std::cos(creaseAngle / 2) + kDoubt)),
          owned_(mesh.positions.size() / 3, false) {
        mesh_.normals.assign(mesh_.positions.size(), 0);
        facets_.reserve(mesh.indices.size() / 3);
        for (std::size_t i = 0; i + 3 <= mesh.indices.size(); i += 3)
            facets_.emplace_back(at(mesh.indices[i]), at(mesh.indices[i + 1]), at(mesh.indices[i + 2]));
    }

    /// `corners`: of one place, numbers in the array of indices.
    void set(std::span<const std::uint32_t> corners) {
        own_.clear();
        weighed_.clear();
        Vec3f sum = Vec3f::Zero();
        for (const std::uint32_t corner : corners) {
            const Facet& facet = facets_[corner / 3];
            own_.push_back(facet.normal);
            weighed_.push_back(facet.weighed(corner % 3));
            sum += weighed_.back();
        }
        // All that are less than half of the angle away from one direction are less than all of it away from each
        // other.
        const Vec3f mean = unit(sum);
        if (std::ranges::all_of(own_, [&](const Vec3f& own) { return own.dot(mean) > allNear_; })) {
            for (const std::uint32_t corner : corners) {
                const std::uint32_t vertex = mesh_.indices[corner];
                owned_[vertex] = true;
                std::copy_n(mean.data(), 3, &mesh_.normals[std::size_t{3} * vertex]);
            }
            return;
        }
        // Of many triangles each would be compared with each.
        constexpr std::size_t kMany = 48;
        corners.size() > kMany ? setByCells(corners) : setOneByOne(corners);
    }

private:
    struct Made {
        std::uint32_t from, vertex;
        Vec3f normal;
    };

    [[nodiscard]] const float* at(std::uint32_t vertex) const { return &mesh_.positions[std::size_t{3} * vertex]; }

    void setOneByOne(std::span<const std::uint32_t> corners) {
        made_.clear();
        for (std::size_t i = 0; i < corners.size(); ++i) {
            Vec3f sum = Vec3f::Zero();
            // One without an area has nothing against any.
            const bool isFlat = own_[i] == Vec3f::Zero();
            for (std::size_t k = 0; k < own_.size(); ++k)
                if (isFlat || own_[i].dot(own_[k]) >= smoothest_) sum += weighed_[k];
            give(corners[i], unit(sum));
        }
    }
    /// By eight times eight cells on each side of a cube: those of one cell are as one.
    void setByCells(std::span<const std::uint32_t> corners) {
        constexpr std::size_t kAcross = 8, kCells = 6 * kAcross * kAcross;
        std::vector<Vec3f> sums(kCells, Vec3f::Zero()), means(kCells, Vec3f::Zero());
        std::vector<std::size_t> used, cellOf(corners.size());
        for (std::size_t i = 0; i < corners.size(); ++i) {
            Eigen::Index axis = 0;
            const float most = own_[i].cwiseAbs().maxCoeff(&axis);
            const auto part = [&](Eigen::Index k) {
                const float share = most > 0 ? own_[i][k] / most : 0;
                return std::min(kAcross - 1, static_cast<std::size_t>((share + 1) * (kAcross / 2.0f)));
            };
            const std::size_t side = static_cast<std::size_t>(2 * axis) + (own_[i][axis] < 0 ? 1 : 0);
            cellOf[i] = (side * kAcross + part((axis + 1) % 3)) * kAcross + part((axis + 2) % 3);
            sums[cellOf[i]] += weighed_[i];
        }
        for (std::size_t cell = 0; cell < kCells; ++cell) {
            if (sums[cell] == Vec3f::Zero()) continue;
            used.push_back(cell);
            means[cell] = unit(sums[cell]);
        }
        std::map<std::size_t, Vec3f> normals;
        std::map<std::pair<std::uint32_t, std::size_t>, std::uint32_t> vertices;
        for (std::size_t i = 0; i < corners.size(); ++i) {
            const auto [normal, isNew] = normals.try_emplace(cellOf[i]);
            if (isNew) {
                Vec3f sum = Vec3f::Zero();
                for (const std::size_t cell : used)
                    if (means[cell].dot(means[cellOf[i]]) >= smoothest_) sum += sums[cell];
                normal->second = unit(sum);
            }
            std::uint32_t& corner = mesh_.indices[corners[i]];
            const auto [vertex, isFirst] = vertices.try_emplace({corner, cellOf[i]});
            if (isFirst) vertex->second = vertexWith(corner, normal->second);
            corner = vertex->second;
        }
    }

    static Vec3f unit(const Vec3f& sum) {
        const float length = sum.norm();
        return length > 1e-20f ? Vec3f(sum / length) : Vec3f(Vec3f::UnitY());
    }
    void give(std::uint32_t corner, const Vec3f& normal) {
        std::uint32_t& vertex = mesh_.indices[corner];
        const auto same =
            std::ranges::find_if(made_, [&](const Made& made) { return made.from == vertex && made.normal == normal; });
        if (same == made_.end()) {
            made_.push_back({vertex, vertexWith(vertex, normal), normal});
            vertex = made_.back().vertex;
        } else {
            vertex = same->vertex;
        }
    }
    /// The vertex itself, or, where another normal has it, a copy of it.
    std::uint32_t vertexWith(std::uint32_t vertex, const Vec3f& normal) {
        std::uint32_t taken = vertex;
        if (owned_[vertex]) {
            const std::size_t vertices = mesh_.positions.size() / 3;
            taken = static_cast<std::uint32_t>(vertices);
            repeat(mesh_.positions, 3, vertices, vertex);
            repeat(mesh_.texcoords, 2, vertices, vertex);
            repeat(mesh_.colors, 4, vertices, vertex);
            mesh_.normals.resize(mesh_.positions.size());
        } else {
            owned_[vertex] = true;
        }
        std::copy_n(normal.data(), 3, &mesh_.normals[std::size_t{3} * taken]);
        return taken;
    }

    /// A direction is near itself, whatever rounding says. What is nearly half of the angle away is looked at.
    static constexpr double kOwn = 0.999999, kDoubt = 7.46e-5;

    MeshData& mesh_;
    float smoothest_, allNear_;  ///< cosines
    std::vector<Facet> facets_;
    std::vector<bool> owned_;     ///< of the vertices that the file has
    std::vector<Vec3f> own_;      ///< of the triangles of the place
    std::vector<Vec3f> weighed_;  ///< by the angle that each has there
    std::vector<Made> made_;
};

}  // namespace

Vec3f facetNormal(const float* a, const float* b, const float* c) {
    const Vec3f normal = normalOrZero(a, b, c);
    return normal == Vec3f::Zero() ? Vec3f(Vec3f::UnitY()) : normal;
}

void setSmoothNormals(MeshData& mesh, double creaseAngle) {
    std::uint32_t places = 0;
    // On a surface are half as many places as triangles.
    const std::size_t expected = std::min(mesh.positions.size() / 3, mesh.indices.size() / 6);
    std::vector<std::uint32_t> placeOf = placesOf(mesh.positions, expected, places);
    // The corners of each place, one place after the other.
    std::vector<std::uint32_t> ends(std::size_t{places} + 1, 0), corners(mesh.indices.size());
    for (const std::uint32_t vertex : mesh.indices) ++ends[placeOf[vertex] + 1];
    for (std::size_t place = 1; place <= places; ++place) ends[place] += ends[place - 1];
    for (std::uint32_t corner = 0; corner < mesh.indices.size(); ++corner)
        corners[ends[placeOf[mesh.indices[corner]]]++] = corner;
    std::vector<std::uint32_t>().swap(placeOf);
    NormalSplit split(mesh, std::clamp(creaseAngle, 0.0, std::numbers::pi));
    for (std::size_t place = 0, begin = 0; place < places; begin = ends[place++])
        split.set(std::span(corners).subspan(begin, ends[place] - begin));
    // Vertices that no triangle names.
    for (std::size_t v = 0; v < mesh.normals.size(); v += 3)
        if (mesh.normals[v] == 0 && mesh.normals[v + 1] == 0 && mesh.normals[v + 2] == 0) mesh.normals[v + 1] = 1;
}

}  // namespace tessera
