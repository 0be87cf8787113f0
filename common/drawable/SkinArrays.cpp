#include "common/drawable/SkinArrays.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "common/drawable/ContentCache.h"

namespace tessera {
namespace {

using Rows = std::array<double, 12>;  // a matrix, row by row

const Skin& skinOf(const void* core) {
    return *static_cast<const Skin*>(core);
}

MeshArrays skinAtRest(const Skin& s) {
    return {.positions = s.positions,
            .normals = s.normals,
            .colors = s.colors,
            .texcoords = s.texcoords,
            .indices = s.indices,
            .texcoords1 = s.texcoords1,
            .lines = {},
            .tangents = s.tangents};
}

/// All but the last two are in the recipe.
std::array<const Blob*, 15> skinBlobs(const Skin& s) {
    return {&s.positions,     &s.normals,      &s.colors,       &s.texcoords,      &s.indices,
            &s.texcoords1,    &s.jointIndices, &s.jointWeights, &s.morphPositions, &s.morphNormals,
            &s.morphTangents, &s.tangents,     &s.weights,      &s.pose,           &s.inverseBinds};
}

bool skinIsHere(const Skin& s) {
    const auto blobs = skinBlobs(s);
    return std::ranges::all_of(blobs, [](const Blob* blob) { return blob->empty() || blob->resident(); });
}

bool skinHoldsNothing(const Skin& s) {
    return s.positions.empty() && s.indices.empty();
}

tl::unexpected<Error> badSkin(std::string why) {
    return fail(ErrorCode::kBadInput, std::move(why));
}

bool hasJoints(const Skin& s) {
    return !s.jointIndices.empty() && !s.jointWeights.empty();
}
bool hasMorphs(const Skin& s) {
    return !s.morphPositions.empty() && !s.weights.empty();
}
/// The joints move something, and it is said where they are.
bool follows(const Skin& s) {
    return hasJoints(s) && !s.pose.empty();
}

/// Of the array whose ranges people edit: where the joints are, or how far targets are gone to.
const Blob& movingArray(const Skin& s) {
    return follows(s) || !hasMorphs(s) ? s.pose : s.weights;
}

Hash128 recipeOfSkin(const Skin& s) {
    std::array<Hash128, 15> parts{};
    parts[0] = {typeOf<Skin>().value, movingArray(s).sizeBytes()};
    const auto blobs = skinBlobs(s);
    for (std::size_t i = 0; i < 13; ++i) parts[1 + i] = blobs[i]->id();
    if (&movingArray(s) == &s.weights) parts[13] = s.pose.id();  // it moves nothing, but two are never told by one key
    parts[14] = {follows(s) ? 1u : 0u, hasMorphs(s) ? 1u : 0u};
    return hash128(std::as_bytes(std::span(parts)));
}

std::string countText(std::size_t count, const char* of) {
    return std::to_string(count) + " " + of;
}

Expected<void> checkSkinNumbers(const Blob& blob, const char* name, std::size_t each) {
    if (blob.sizeBytes() % (each * sizeof(float)) != 0)
        return badSkin(std::string(name) + " has " + countText(blob.sizeBytes(), "bytes, no whole number of ") +
                       std::to_string(each) + " floats each");
    const std::span<const float> numbers = blob.as<float>();
    for (std::size_t i = 0; i < numbers.size(); ++i)
        if (!(std::abs(static_cast<double>(numbers[i])) <= kGreatestSkinNumber))
            return badSkin(std::string(name) + " " + std::to_string(i / each) +
                           " holds a number that is not within 1e15");
    return {};
}

/// Nothing: nobody says how many there are.
std::size_t jointCountOf(const Skin& s) {
    if (!s.joints.empty()) return s.joints.size();
    return static_cast<std::size_t>((s.pose.empty() ? s.inverseBinds : s.pose).sizeBytes() / sizeof(float) / 12);
}

Expected<void> checkJoints(const Skin& s, std::size_t vertices) {
    const std::size_t joints = jointCountOf(s);
    for (const auto& [blob, name] : {std::pair(&s.pose, "pose"), std::pair(&s.inverseBinds, "inverseBinds")})
        if (!blob->empty() && blob->sizeBytes() / sizeof(float) / 12 != joints)
            return badSkin(std::string(name) + " is of " +
                           countText(blob->sizeBytes() / sizeof(float) / 12, "joints, and the skin has ") +
                           std::to_string(joints));
    if (!s.jointIndices.empty() && s.jointIndices.sizeBytes() != vertices * 4 * sizeof(std::uint16_t))
        return badSkin("jointIndices has " + countText(s.jointIndices.sizeBytes(), "bytes; ") +
                       countText(vertices, "vertices with four each have ") + std::to_string(vertices * 8));
    if (!s.jointWeights.empty() && s.jointWeights.sizeBytes() != vertices * 4 * sizeof(float))
        return badSkin("jointWeights has " + countText(s.jointWeights.sizeBytes(), "bytes; ") +
                       countText(vertices, "vertices with four each have ") + std::to_string(vertices * 16));
    if (!hasJoints(s)) return {};
    const std::span<const std::uint16_t> indices = s.jointIndices.as<std::uint16_t>();
    const std::span<const float> weights = s.jointWeights.as<float>();
    for (std::size_t v = 0; v < vertices; ++v) {
        double sum = 0;
        for (std::size_t k = 4 * v; k < 4 * v + 4; ++k) {
            if (!(weights[k] >= 0 && static_cast<double>(weights[k]) <= kGreatestSkinNumber))
                return badSkin("vertex " + std::to_string(v) + " has a joint weight that is no number from 0 to 1e15");
            sum += static_cast<double>(weights[k]);
            if (weights[k] > 0 && indices[k] >= joints)
                return badSkin("vertex " + std::to_string(v) + " follows joint " + std::to_string(indices[k]) + " of " +
                               std::to_string(joints));
        }
        if (!(sum > 1e-30)) return badSkin("vertex " + std::to_string(v) + " has no joint weight above 0");
    }
    return {};
}

Expected<void> checkMorphs(const Skin& s, std::size_t vertices) {
    const std::size_t each = vertices * 3 * sizeof(float);
    for (const auto& [blob, name] :
         {std::pair(&s.morphPositions, "morphPositions"), std::pair(&s.morphNormals, "morphNormals"),
          std::pair(&s.morphTangents, "morphTangents")}) {
        if (blob->empty()) continue;
        if (each == 0 || blob->sizeBytes() % each != 0)
            return badSkin(std::string(name) + " has " +
                           countText(blob->sizeBytes(), "bytes, no whole number of targets of ") +
                           countText(vertices, "vertices"));
        if (const Expected<void> numbers = checkSkinNumbers(*blob, name, 3); !numbers) return numbers;
    }
    const std::size_t targets = each == 0 ? 0 : static_cast<std::size_t>(s.morphPositions.sizeBytes()) / each;
    for (const auto& [blob, name] :
         {std::pair(&s.morphNormals, "morphNormals"), std::pair(&s.morphTangents, "morphTangents")})
        if (!blob->empty() && !s.morphPositions.empty() && blob->sizeBytes() != s.morphPositions.sizeBytes())
            return badSkin(std::string(name) + " and morphPositions are of different numbers of targets");
    if (hasMorphs(s) && s.weights.sizeBytes() / sizeof(float) != targets)
        return badSkin("weights has " + countText(s.weights.sizeBytes() / sizeof(float), "numbers, and there are ") +
                       countText(targets, "targets"));
    return {};
}

Expected<void> checkSkin(const void* core) {
    const Skin& s = skinOf(core);
    if (!skinIsHere(s)) return badSkin("an array of the skin is not here");
    if (const Expected<void> pose = checkSkinNumbers(s.pose, "pose", 12); !pose) return pose;
    if (const Expected<void> binds = checkSkinNumbers(s.inverseBinds, "inverseBinds", 12); !binds) return binds;
    if (const Expected<void> weights = checkSkinNumbers(s.weights, "weights", 1); !weights) return weights;
    if (!skinHoldsNothing(s))
        if (const Expected<void> mesh = checkMesh(skinAtRest(s)); !mesh)
            return failWith("the mesh at rest", mesh.error());
    const std::size_t vertices = static_cast<std::size_t>(s.positions.sizeBytes()) / (3 * sizeof(float));
    if (const Expected<void> joints = checkJoints(s, vertices); !joints) return joints;
    return checkMorphs(s, vertices);
}

/// Which vertices each joint moves: from the first to behind the last.
struct SkinPlan {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> moved;
};

std::shared_ptr<const SkinPlan> planOfSkin(const Skin& s) {
    auto plan = std::make_shared<SkinPlan>();
    if (!follows(s)) return plan;
    plan->moved.assign(jointCountOf(s), {0, 0});
    const std::span<const std::uint16_t> indices = s.jointIndices.as<std::uint16_t>();
    const std::span<const float> weights = s.jointWeights.as<float>();
    for (std::size_t k = 0; k < indices.size(); ++k) {
        if (!(weights[k] > 0) || indices[k] >= plan->moved.size()) continue;
        auto& [first, end] = plan->moved[indices[k]];
        const auto vertex = static_cast<std::uint32_t>(k / 4);
        if (first == end) first = vertex;
        end = vertex + 1;
    }
    return plan;
}

/// Deforms vertices of one state of a skin that is sound.
class SkinDeformer {
public:
    explicit SkinDeformer(const Skin& s)
        : rest_(s.positions.as<float>()), normals_(s.normals.as<float>()), tangents_(s.tangents.as<float>()) {
        if (hasMorphs(s)) {
            const std::span<const float> weights = s.weights.as<float>();
            for (std::size_t t = 0; t < weights.size(); ++t) {
                if (weights[t] == 0) continue;
                const auto of = [&](const Blob& deltas, std::span<const float> rest) {
                    return deltas.empty() || rest.empty() ? std::span<const float>()
                                                          : deltas.as<float>().subspan(t * rest_.size(), rest_.size());
                };
                targets_.push_back({static_cast<double>(weights[t]), of(s.morphPositions, rest_),
                                    of(s.morphNormals, normals_), of(s.morphTangents, tangents_)});
            }
        }
        if (!follows(s)) return;
        indices_ = s.jointIndices.as<std::uint16_t>();
        weights_ = s.jointWeights.as<float>();
        const std::span<const float> pose = s.pose.as<float>();
        pose_.resize(pose.size() / 12);
        for (std::size_t i = 0; i < pose.size(); ++i) pose_[i / 12][i % 12] = static_cast<double>(pose[i]);
    }

    /// Where vertex v is, into three floats; its normal into three and its tangent into four, where there are any.
    void deform(std::size_t v, float* position, float* normal, float* tangent) const {
        std::array<double, 3> p = morphed(v, rest_, 3, &Target::positions), n{}, t{};
        if (normal) n = morphed(v, normals_, 3, &Target::normals);
        if (tangent) t = morphed(v, tangents_, 4, &Target::tangents);
        if (!indices_.empty()) {
            const Rows m = blended(v);
            p = moved(m, p);
            for (std::size_t r = 0; r < 3; ++r) p[r] += m[4 * r + 3];
            if (normal) n = turned(m, n);
            // Its side stays: in a mirror normals, by the cofactors, turn over with their triangles.
            if (tangent) t = moved(m, t);
        }
        for (std::size_t r = 0; r < 3; ++r) position[r] = toFloat(p[r]);
        if (normal) normalise(n, &normals_[3 * v], normal);
        if (!tangent) return;
        normalise(t, &tangents_[4 * v], tangent);
        tangent[3] = tangents_[4 * v + 3];
    }

private:
    struct Target {
        double weight;
        std::span<const float> positions, normals, tangents;
    };
    static constexpr double kFarthest = 1e30;  ///< of sums of many, as floats
    static float toFloat(double number) { return static_cast<float>(std::clamp(number, -kFarthest, kFarthest)); }

    /// What is crushed stays as at rest.
    static void normalise(const std::array<double, 3>& n, const float* atRest, float* to) {
        const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (std::size_t r = 0; r < 3; ++r)
            to[r] = length > 1e-100 && std::isfinite(length) ? static_cast<float>(n[r] / length) : atRest[r];
    }

    static std::array<double, 3> moved(const Rows& m, const std::array<double, 3>& v) {
        std::array<double, 3> out{};
        for (std::size_t r = 0; r < 3; ++r) out[r] = m[4 * r] * v[0] + m[4 * r + 1] * v[1] + m[4 * r + 2] * v[2];
        return out;
    }

    std::array<double, 3> morphed(std::size_t v, std::span<const float> from, std::size_t each,
                                  std::span<const float> Target::*deltas) const {
        std::array<double, 3> sum{};
        for (std::size_t r = 0; r < 3; ++r) sum[r] = static_cast<double>(from[each * v + r]);
        for (const Target& target : targets_) {
            const std::span<const float> delta = target.*deltas;
            if (delta.empty()) continue;
            for (std::size_t r = 0; r < 3; ++r) sum[r] += target.weight * static_cast<double>(delta[3 * v + r]);
        }
        return sum;
    }

    Rows blended(std::size_t v) const {
        double sum = 0;
        for (std::size_t k = 4 * v; k < 4 * v + 4; ++k) sum += static_cast<double>(weights_[k]);
        Rows m{};
        for (std::size_t k = 4 * v; k < 4 * v + 4; ++k) {
            if (!(weights_[k] > 0)) continue;
            const double weight = static_cast<double>(weights_[k]) / sum;
            const Rows& joint = pose_[indices_[k]];
            for (std::size_t i = 0; i < 12; ++i) m[i] += weight * joint[i];
        }
        return m;
    }

    /// By the cofactors of the matrix, scaled so that nothing is lost of very small or large ones.
    static std::array<double, 3> turned(const Rows& m, const std::array<double, 3>& n) {
        double greatest = 0;
        for (std::size_t r = 0; r < 3; ++r)
            for (std::size_t c = 0; c < 3; ++c) greatest = std::max(greatest, std::abs(m[4 * r + c]));
        if (!(greatest > 0)) return {};
        const auto at = [&](std::size_t r, std::size_t c) { return m[4 * (r % 3) + c % 3] / greatest; };
        std::array<double, 3> out{};
        for (std::size_t r = 0; r < 3; ++r)
            for (std::size_t c = 0; c < 3; ++c)
                out[r] += (at(r + 1, c + 1) * at(r + 2, c + 2) - at(r + 1, c + 2) * at(r + 2, c + 1)) * n[c];
        return out;
    }

    std::span<const float> rest_, normals_, tangents_;
    std::vector<Target> targets_;
    std::span<const std::uint16_t> indices_;
    std::span<const float> weights_;
    std::vector<Rows> pose_;
};

std::optional<DerivedSource> sourceOfSkin(const void* core, const Fineness&) {
    const Skin& s = skinOf(core);
    if (skinHoldsNothing(s) || !skinIsHere(s)) return std::nullopt;
    return DerivedSource{recipeOfSkin(s), movingArray(s)};
}

DerivedMesh deriveSkin(const void* core, const Fineness&, const EarlierMesh* earlier) {
    const Skin& s = skinOf(core);
    // Who follows edits has looked at the rest before.
    if (earlier) {
        const Blob& moving = movingArray(s);
        const std::span<const float> numbers = moving.as<float>().subspan(0, moving.sizeBytes() / sizeof(float));
        const ByteRange range = elementsOf(earlier->changed, sizeof(float));
        for (std::size_t i = range.begin; i < std::min<std::size_t>(range.end, numbers.size()); ++i)
            if (!(std::abs(static_cast<double>(numbers[i])) <= kGreatestSkinNumber)) return {};
    } else if (!checkSkin(core)) {
        return {};
    }
    DerivedMesh out{.arrays = skinAtRest(s), .plan = earlier ? earlier->mesh.plan : planOfSkin(s)};
    if (!follows(s) && !hasMorphs(s)) return out;
    const std::size_t vertices = static_cast<std::size_t>(s.positions.sizeBytes()) / (3 * sizeof(float));
    std::size_t first = 0, end = vertices;
    if (earlier && follows(s)) {
        const auto& moved = static_cast<const SkinPlan*>(earlier->mesh.plan.get())->moved;
        const ByteRange joints = elementsOf(earlier->changed, sizeof(float) * 12);
        first = vertices;
        end = 0;
        for (std::size_t j = joints.begin; j < std::min<std::size_t>(joints.end, moved.size()); ++j) {
            if (moved[j].first == moved[j].second) continue;
            first = std::min<std::size_t>(first, moved[j].first);
            end = std::max<std::size_t>(end, moved[j].second);
        }
    }
    if (earlier) {
        out.arrays.positions = earlier->mesh.arrays.positions;
        out.arrays.normals = earlier->mesh.arrays.normals;
        out.arrays.tangents = earlier->mesh.arrays.tangents;
        if (first >= end) return out;
    }
    const SkinDeformer deformer(s);
    const std::size_t count = end - first;
    std::vector<float> positions(3 * count), normals(s.normals.empty() ? 0 : 3 * count),
        tangents(s.tangents.empty() ? 0 : 4 * count);
    const auto of = [&](std::vector<float>& values, std::size_t each, std::size_t v) {
        return values.empty() ? nullptr : &values[each * (v - first)];
    };
    for (std::size_t v = first; v < end; ++v)
        deformer.deform(v, of(positions, 3, v), of(normals, 3, v), of(tangents, 4, v));
    const auto put = [&](Blob& array, const std::vector<float>& values, std::size_t each) {
        if (values.empty()) return;
        array = earlier ? *array.withRange(each * sizeof(float) * first, std::as_bytes(std::span(values)))
                        : Blob::of(std::span(values));
    };
    put(out.arrays.positions, positions, 3);
    put(out.arrays.normals, normals, 3);
    put(out.arrays.tangents, tangents, 4);
    return out;
}

}  // namespace

constinit const Derivation kSkinDerivation{
    .check = &checkSkin,
    .source = &sourceOfSkin,
    .derive = &deriveSkin,
    .resident = [](const void* core) { return skinIsHere(skinOf(core)); },
};

}  // namespace tessera
