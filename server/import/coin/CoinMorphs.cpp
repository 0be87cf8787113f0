#include "server/import/coin/CoinMorphs.h"

#include <Inventor/VRMLnodes/SoVRMLCoordinate.h>
#include <Inventor/VRMLnodes/SoVRMLCoordinateInterpolator.h>
#include <Inventor/VRMLnodes/SoVRMLIndexedFaceSet.h>
#include <Inventor/VRMLnodes/SoVRMLNormal.h>
#include <Inventor/fields/SoSFNode.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <span>
#include <unordered_map>

#include "common/base/Hash.h"
#include "server/import/coin/CoinNodes.h"
#include "server/import/reader/MovingParts.h"
#include "server/import/reader/SmoothNormals.h"
#include "server/import/reader/SoundParts.h"

namespace tessera {
namespace {

/// Corners of all keys that a small file may have; a large one has one more for so many bytes (a point written out
/// takes some 18, and is of six corners). Each takes 36 bytes: together half a gibibyte at most.
constexpr std::size_t kAlwaysMoving = 2'000'000, kBytesPerMoving = 2, kMostMoving = 14'000'000;

SoVRMLCoordinate* coordinateOf(const SoNode& geometry) {
    const SoField* const field = geometry.getField("coord");
    if (field == nullptr || !field->isOfType(SoSFNode::getClassTypeId())) return nullptr;
    SoNode* const coord = static_cast<const SoSFNode*>(field)->getValue();
    return coord != nullptr && is<SoVRMLCoordinate>(*coord) ? static_cast<SoVRMLCoordinate*>(coord) : nullptr;
}

std::vector<int32_t> indicesIn(const SoMFInt32& field) {
    const int32_t* const values = field.getValues(0);
    return {values, values + field.getNum()};
}

/// Of a set's corners by their place in coordIndex: the file's normals.
class OwnNormals {
public:
    explicit OwnNormals(const SoVRMLIndexedFaceSet& set) : perVertex_(set.normalPerVertex.getValue() != FALSE) {
        SoNode* const normal = set.normal.getValue();
        if (normal == nullptr || !is<SoVRMLNormal>(*normal)) return;
        const SoMFVec3f& vector = as<SoVRMLNormal>(*normal).vector;
        normals_.assign(vector.getValues(0), vector.getValues(0) + vector.getNum());
        const std::vector<int32_t> corners = indicesIn(set.coordIndex), numbers = indicesIn(set.normalIndex);
        int32_t face = 0;
        for (std::size_t i = 0; i < corners.size(); ++i) {
            const bool ends = corners[i] < 0;
            const auto at = perVertex_ ? i : static_cast<std::size_t>(face);
            const int32_t unnamed = perVertex_ ? corners[i] : face;
            number_.push_back(ends ? 0 : numbers.empty() ? unnamed : at < numbers.size() ? numbers[at] : 0);
            if (ends && i > 0 && corners[i - 1] >= 0) ++face;
        }
    }
    [[nodiscard]] bool empty() const { return normals_.empty(); }
    [[nodiscard]] Vec3f at(std::size_t corner) const {
        const int32_t number = number_[corner];
        const bool isThere = number >= 0 && static_cast<std::size_t>(number) < normals_.size();
        const SbVec3f& own = normals_[isThere ? static_cast<std::size_t>(number) : 0];
        const Vec3f normal(own[0], own[1], own[2]);
        const float length = normal.norm();
        return length > 1e-20f && std::isfinite(length) ? Vec3f(normal / length) : Vec3f(0, 1, 0);
    }

private:
    bool perVertex_;
    std::vector<SbVec3f> normals_;
    std::vector<int32_t> number_;
};

/// While this is there the set's normals say which corner each is, by its place in coordIndex: nothing else of what
/// Coin generates does, when it has cut polygons.
class CornerNumbers {
public:
    explicit CornerNumbers(SoVRMLIndexedFaceSet& set)
        : set_(set),
          normal_(set.normal.getValue()),
          eachVertex_(set.normalPerVertex.getValue()),
          index_(indicesIn(set.normalIndex)) {
        if (normal_ != nullptr) normal_->ref();
        std::vector<int32_t> numbers = indicesIn(set.coordIndex);
        std::vector<SbVec3f> coded;
        for (std::size_t i = 0; i < numbers.size(); ++i) {
            // Floats hold each half exactly.
            coded.emplace_back(static_cast<float>(i & 0xffff), static_cast<float>(i >> 16), 1.0f);
            if (numbers[i] >= 0) numbers[i] = static_cast<int32_t>(i);
        }
        auto* const normal = new SoVRMLNormal;
        normal->vector.setValues(0, static_cast<int>(coded.size()), coded.data());
        set_.normalPerVertex = TRUE;
        set_.normalIndex.setNum(static_cast<int>(numbers.size()));
        set_.normalIndex.setValues(0, static_cast<int>(numbers.size()), numbers.data());
        set_.normal = normal;
    }
    ~CornerNumbers() {
        set_.normal = normal_;
        if (normal_ != nullptr) normal_->unref();
        set_.normalPerVertex = eachVertex_;
        set_.normalIndex.setNum(static_cast<int>(index_.size()));
        set_.normalIndex.setValues(0, static_cast<int>(index_.size()), index_.data());
    }
    CornerNumbers(const CornerNumbers&) = delete;
    CornerNumbers& operator=(const CornerNumbers&) = delete;

    [[nodiscard]] static std::size_t of(const float* normal) {
        return static_cast<std::size_t>(normal[0]) | static_cast<std::size_t>(normal[1]) << 16;
    }

private:
    SoVRMLIndexedFaceSet& set_;
    SoNode* normal_;
    SbBool eachVertex_;
    std::vector<int32_t> index_;
};

/// Where each point is, by its number.
using PointPlaces = std::span<const SbVec3f>;

/// The places of the interpolator's keys: those that differ, and which of them each key has. At rest is none.
struct KeyPlaces {
    static constexpr std::size_t kRest = SIZE_MAX;
    std::vector<PointPlaces> targets;
    std::vector<std::size_t> ofKey;

    KeyPlaces() = default;
    KeyPlaces(const SoVRMLCoordinateInterpolator& by, PointPlaces rest) {
        const auto keys = static_cast<std::size_t>(by.key.getNum());
        const std::size_t each = static_cast<std::size_t>(by.keyValue.getNum()) / keys;
        const auto hashOfPoints = [](PointPlaces points) { return hash128(std::as_bytes(points)); };
        std::unordered_map<Hash128, std::size_t> known;
        known.emplace(hashOfPoints(rest), kRest);
        for (std::size_t k = 0; k < keys; ++k) {
            const PointPlaces points(by.keyValue.getValues(static_cast<int>(k * each)), each);
            const auto [target, isNew] = known.try_emplace(hashOfPoints(points), targets.size());
            if (isNew) targets.push_back(points);
            ofKey.push_back(target->second);
        }
    }
    [[nodiscard]] std::vector<double> weights() const {
        std::vector<double> all(ofKey.size() * targets.size(), 0.0);
        for (std::size_t k = 0; k < ofKey.size(); ++k)
            if (ofKey[k] != kRest) all[k * targets.size() + ofKey[k]] = 1;
        return all;
    }
};

/// Triangles whose corners know their points: one after the other, none shared.
class MovingCorners {
public:
    /// `mesh`: each vertex one corner of coordIndex. `points`: of each vertex.
    MovingCorners(const MeshData& mesh, std::vector<std::uint32_t> points) : mesh_(mesh), points_(std::move(points)) {}

    [[nodiscard]] std::size_t size() const { return mesh_.indices.size(); }
    [[nodiscard]] std::uint32_t point(std::size_t corner) const { return points_[mesh_.indices[corner]]; }

    /// Normals of all, in their order, where points are so. Those that `places` lacks are at rest.
    [[nodiscard]] std::vector<float> normalsAt(PointPlaces places, double creaseAngle) const {
        MeshData loose;
        loose.positions.reserve(3 * size());
        loose.indices.reserve(size());
        for (std::size_t i = 0; i < size(); ++i) {
            const Vec3f at = placeOf(mesh_.indices[i], places);
            loose.positions.insert(loose.positions.end(), at.data(), at.data() + 3);
            loose.indices.push_back(static_cast<std::uint32_t>(i));
        }
        // No vertex has two triangles: none is split.
        setSmoothNormals(loose, creaseAngle);
        return std::move(loose.normals);
    }
    [[nodiscard]] Vec3f placeOf(std::uint32_t vertex, PointPlaces places) const {
        const std::uint32_t point = points_[vertex];
        if (point < places.size()) return {places[point][0], places[point][1], places[point][2]};
        const float* const rest = &mesh_.positions[std::size_t{3} * vertex];
        return {rest[0], rest[1], rest[2]};
    }
    /// Whether all are finite, and not so far away that a skin could not hold it.
    [[nodiscard]] bool stand(PointPlaces places) const {
        return std::ranges::all_of(mesh_.indices, [&](std::uint32_t vertex) {
            const Vec3f way = placeOf(vertex, places) - placeOf(vertex, {});
            return holdsSkinNumbers({way.data(), 3});
        });
    }
    [[nodiscard]] const MeshData& mesh() const { return mesh_; }

private:
    const MeshData& mesh_;
    std::vector<std::uint32_t> points_;
};

/// Joins corners that are the same at rest and at all keys.
class CornerJoin {
public:
    /// `normals`: of all corners, at rest and then at each target.
    CornerJoin(const MovingCorners& corners, const std::vector<std::vector<float>>& normals) {
        const MeshData& from = corners.mesh();
        std::unordered_map<Hash128, std::uint32_t> known;
        std::vector<std::uint32_t> row;
        for (std::size_t i = 0; i < corners.size(); ++i) {
            const std::size_t vertex = from.indices[i];
            row.assign(1, corners.point(i));
            const auto addBits = [&](const auto& values, std::size_t each, std::size_t at) {
                for (std::size_t k = 0; k < each && !values.empty(); ++k)
                    row.push_back(std::bit_cast<std::uint32_t>(values[each * at + k]));
            };
            addBits(from.texcoords, 2, vertex);
            for (const std::vector<float>& each : normals) addBits(each, 3, i);
            for (std::size_t k = 0; k < 4 && !from.colors.empty(); ++k) row.push_back(from.colors[4 * vertex + k]);
            const auto [place, isNew] =
                known.try_emplace(hash128(std::as_bytes(std::span(row))), static_cast<std::uint32_t>(first_.size()));
            if (isNew) first_.push_back(static_cast<std::uint32_t>(i));
            indices_.push_back(place->second);
        }
    }
    /// Of each joined one a corner.
    [[nodiscard]] std::span<const std::uint32_t> first() const { return first_; }
    [[nodiscard]] std::vector<std::uint32_t> takeIndices() { return std::move(indices_); }

private:
    std::vector<std::uint32_t> first_, indices_;
};

}  // namespace

CoinMorphs::CoinMorphs(CoinMotion& motion, CountedNotes& notes, std::size_t textBytes)
    : motion_(motion), notes_(notes), room_(std::min(kAlwaysMoving + textBytes / kBytesPerMoving, kMostMoving)) {}

void CoinMorphs::standStill(const SoNode& geometry, const char* why) {
    const SoNode* const coordinate = coordinateOf(geometry);
    notes_.add(fmt::format("points of a Coordinate stand still: {}", why),
               nameOf(coordinate != nullptr ? *coordinate : geometry));
}

bool CoinMorphs::takeRoom(std::size_t times, std::size_t numbers) {
    const double needed = static_cast<double>(times) * static_cast<double>(numbers);
    if (needed > static_cast<double>(room_)) return false;
    room_ -= static_cast<std::size_t>(needed);
    return true;
}

bool CoinMorphs::prepare(SoNode& geometry) {
    const auto [known, isNew] = prepared_.try_emplace(&geometry, false);
    if (!isNew) return known->second;
    SoVRMLCoordinate* const coordinate = coordinateOf(geometry);
    const SoVRMLCoordinateInterpolator* const by = coordinate != nullptr ? motion_.pointsOf(*coordinate) : nullptr;
    const char* why = nullptr;
    if (!is<SoVRMLIndexedFaceSet>(geometry))
        why = "only faces are moved point by point here";
    else if (by == nullptr)
        why = "no CoordinateInterpolator drives them";
    else if (by->key.getNum() == 0)
        why = "their interpolator has no keys";
    else if (by->keyValue.getNum() < by->key.getNum())
        why = "their interpolator has fewer values than keys";
    if (why != nullptr) {
        standStill(geometry, why);
        return false;
    }
    const int each = by->keyValue.getNum() / by->key.getNum();
    if (by->keyValue.getNum() % by->key.getNum() != 0)
        notes_.add("an interpolator's values are no multiple of its keys: the last ones are left out", nameOf(*by));
    const int have = coordinate->point.getNum();
    if (have > each)
        notes_.add("a Coordinate has more points than its interpolator: the others stand still", nameOf(*coordinate));
    if (have < each) {
        coordinate->point.disconnect();  // else what a prototype says may come again
        const std::vector<SbVec3f> first(by->keyValue.getValues(have), by->keyValue.getValues(have) + (each - have));
        coordinate->point.setNum(each);
        coordinate->point.setValues(have, each - have, first.data());
    }
    return known->second = true;
}

Expected<CoinMorphs::Faces> CoinMorphs::gather(CoinShapes& shapes, SoNode& shape, SoNode& geometry, bool textured) {
    auto& set = static_cast<SoVRMLIndexedFaceSet&>(geometry);
    const SoVRMLCoordinate& coordinate = *coordinateOf(geometry);
    const PointPlaces rest(coordinate.point.getValues(0), static_cast<std::size_t>(coordinate.point.getNum()));
    // Normals that would move, too, are made of the points instead.
    SoNode* const normal = set.normal.getValue();
    const bool normalsMove = normal != nullptr && motion_.drives(*normal, "vector");
    const OwnNormals own(set);
    Faces faces;
    Expected<CoinShapes::Parts> parts;
    {
        const CornerNumbers numbers(set);
        parts = shapes.gather(shape, {.textured = textured,
                                      .reversed = set.ccw.getValue() == FALSE,
                                      .rawNormals = true,
                                      .ownColors = hasColors(geometry)});
    }
    if (!parts) return tl::unexpected(parts.error());
    if (parts->meshes.empty() || parts->meshes.front().primitive != Primitive::kTriangles) return faces;
    faces.colored = parts->colored;
    MeshData mesh = std::move(parts->meshes.front());
    const std::vector<int32_t> coordIndex = indicesIn(set.coordIndex);
    std::vector<std::size_t> cornerOf;
    std::vector<std::uint32_t> points;
    for (std::size_t v = 0; 3 * v < mesh.positions.size(); ++v) {
        cornerOf.push_back(std::min(CornerNumbers::of(&mesh.normals[3 * v]), coordIndex.size() - 1));
        points.push_back(static_cast<std::uint32_t>(std::max(coordIndex[cornerOf.back()], 0)));
    }
    std::vector<std::uint32_t> kept;
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
        const std::array<std::uint32_t, 3> corner = {mesh.indices[i], mesh.indices[i + 1], mesh.indices[i + 2]};
        // What was mended away, or is nothing at any time.
        if (points[corner[0]] == points[corner[1]] && points[corner[1]] == points[corner[2]]) continue;
        kept.insert(kept.end(), corner.begin(), corner.end());
    }
    mesh.indices = std::move(kept);
    faces.lost = keepSoundParts(mesh, "IndexedFaceSet");
    if (mesh.indices.empty()) return faces;

    const MovingCorners corners(mesh, std::move(points));
    const SoVRMLCoordinateInterpolator& by = *motion_.pointsOf(coordinate);
    KeyPlaces keys;
    const char* why = "keys times corners are more than there is room for (fewer keys would help)";
    // Looking at the keys takes time, too: many geometries may be of one interpolator.
    if (takeRoom(1, rest.size() + static_cast<std::size_t>(by.keyValue.getNum()))) {
        keys = KeyPlaces(by, rest);
        if (takeRoom(keys.targets.size(), mesh.indices.size() + keys.ofKey.size()))
            why = std::ranges::all_of(keys.targets, [&](PointPlaces places) { return corners.stand(places); })
                      ? nullptr
                      : "a value of their interpolator is not finite, or beyond 1e15";
    }
    if (why != nullptr) {
        standStill(geometry, why);
        keys.targets.clear();
    }
    std::vector<std::vector<float>> normals(1);
    if (own.empty() || normalsMove) {
        const double creaseAngle = set.creaseAngle.getValue();
        normals.front() = corners.normalsAt({}, creaseAngle);
        for (const PointPlaces places : keys.targets) normals.push_back(corners.normalsAt(places, creaseAngle));
    } else {
        for (const std::uint32_t vertex : mesh.indices) {
            const Vec3f at = own.at(cornerOf[vertex]);
            normals.front().insert(normals.front().end(), at.data(), at.data() + 3);
        }
    }
    CornerJoin join(corners, normals);
    MeshData& made = faces.mesh;
    for (const std::uint32_t i : join.first()) {
        const auto copy = [](auto& to, const auto& from, std::size_t each, std::size_t at) {
            for (std::size_t k = 0; k < each && !from.empty(); ++k) to.push_back(from[each * at + k]);
        };
        const std::size_t vertex = mesh.indices[i];
        copy(made.positions, mesh.positions, 3, vertex);
        copy(made.texcoords, mesh.texcoords, 2, vertex);
        copy(made.colors, mesh.colors, 4, vertex);
        copy(made.normals, normals.front(), 3, i);
        faces.morph.bounds.extend(corners.placeOf(mesh.indices[i], {}).cast<double>());
    }
    faces.morph.targets = keys.targets.size();
    if (keys.targets.empty()) {
        made.indices = join.takeIndices();
        return faces;
    }
    faces.morph.weights = keys.weights();
    for (std::size_t t = 0; t < keys.targets.size(); ++t)
        for (const std::uint32_t i : join.first()) {
            const Vec3f place = corners.placeOf(mesh.indices[i], keys.targets[t]);
            const Vec3f way = place - corners.placeOf(mesh.indices[i], {});
            faces.morph.bounds.extend(place.cast<double>());
            for (Eigen::Index c = 0; c < 3; ++c) {
                faces.morph.positions.push_back(way[c]);
                if (normals.size() > 1) {
                    const std::size_t at = 3 * std::size_t{i} + static_cast<std::size_t>(c);
                    faces.morph.normals.push_back(normals[t + 1][at] - normals.front()[at]);
                }
            }
        }
    made.indices = join.takeIndices();
    return faces;
}

}  // namespace tessera
