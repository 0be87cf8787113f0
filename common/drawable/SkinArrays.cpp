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
            .texcoords1 = s.texcoords1};
}

std::array<const Blob*, 13> skinBlobs(const Skin& s) {
    return {&s.positions,  &s.normals,      &s.colors,       &s.texcoords,      &s.indices,
            &s.texcoords1, &s.jointIndices, &s.jointWeights, &s.morphPositions, &s.morphNormals,
            &s.weights,    &s.pose,         &s.inverseBinds};
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
    std::array<Hash128, 13> parts{};
    parts[0] = {typeOf<Skin>().value, movingArray(s).sizeBytes()};
    const auto blobs = skinBlobs(s);
    for (std::size_t i = 0; i < 11; ++i) parts[1 + i] = blobs[i]->id();
    if (&movingArray(s) == &s.weights) parts[11] = s.pose.id();  // it moves nothing, but two are never told by one key
    parts[12] = {follows(s) ? 1u : 0u, hasMorphs(s) ? 1u : 0u};
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
         {std::pair(&s.morphPositions, "morphPositions"), std::pair(&s.morphNormals, "morphNormals")}) {
        if (blob->empty()) continue;
        if (each == 0 || blob->sizeBytes() % each != 0)
            return badSkin(std::string(name) + " has " +
                           countText(blob->sizeBytes(), "bytes, no whole number of targets of ") +
                           countText(vertices, "vertices"));
        if (const Expected<void> numbers = checkSkinNumbers(*blob, name, 3); !numbers) return numbers;
    }
    const std::size_t targets = each == 0 ? 0 : static_cast<std::size_t>(s.morphPositions.sizeBytes()) / each;
    if (!s.morphNormals.empty() && !s.morphPositions.empty() &&
        s.morphNormals.sizeBytes() != s.morphPositions.sizeBytes())
        return badSkin("morphNormals and morphPositions are of different numbers of targets");
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
    explicit SkinDeformer(const Skin& s) : rest_(s.positions.as<float>()), normals_(s.normals.as<float>()) {
        if (hasMorphs(s)) {
            const std::span<const float> weights = s.weights.as<float>();
            const std::span<const float> positions = s.morphPositions.as<float>(), normals = s.morphNormals.as<float>();
            for (std::size_t t = 0; t < weights.size(); ++t) {
                if (weights[t] == 0) continue;
                targets_.push_back({static_cast<double>(weights[t]), positions.subspan(t * rest_.size(), rest_.size()),
                                    normals.empty() || normals_.empty()
                                        ? std::span<const float>()
                                        : normals.subspan(t * rest_.size(), rest_.size())});
            }
        }
        if (!follows(s)) return;
        indices_ = s.jointIndices.as<std::uint16_t>();
        weights_ = s.jointWeights.as<float>();
        const std::span<const float> pose = s.pose.as<float>();
        pose_.resize(pose.size() / 12);
        for (std::size_t i = 0; i < pose.size(); ++i) pose_[i / 12][i % 12] = static_cast<double>(pose[i]);
    }

    /// Where vertex v is, into three floats; its normal, where there are any.
    void deform(std::size_t v, float* position, float* normal) const {
        std::array<double, 3> p = morphed(v, rest_, &Target::positions);
        std::array<double, 3> n{};
        if (normal) n = morphed(v, normals_, &Target::normals);
        if (!indices_.empty()) {
            const Rows m = blended(v);
            const std::array<double, 3> at = p;
            for (std::size_t r = 0; r < 3; ++r)
                p[r] = m[4 * r] * at[0] + m[4 * r + 1] * at[1] + m[4 * r + 2] * at[2] + m[4 * r + 3];
            if (normal) n = turned(m, n);
        }
        for (std::size_t r = 0; r < 3; ++r) position[r] = toFloat(p[r]);
        if (!normal) return;
        const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (std::size_t r = 0; r < 3; ++r)
            normal[r] = length > 1e-100 && std::isfinite(length) ? static_cast<float>(n[r] / length)
                                                                 : normals_[3 * v + r];  // crushed: as at rest
    }

private:
    struct Target {
        double weight;
        std::span<const float> positions, normals;
    };
    static constexpr double kFarthest = 1e30;  ///< of sums of many, as floats
    static float toFloat(double number) { return static_cast<float>(std::clamp(number, -kFarthest, kFarthest)); }

    std::array<double, 3> morphed(std::size_t v, std::span<const float> from,
                                  std::span<const float> Target::*deltas) const {
        std::array<double, 3> sum{};
        for (std::size_t r = 0; r < 3; ++r) sum[r] = static_cast<double>(from[3 * v + r]);
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

    std::span<const float> rest_, normals_;
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
        if (first >= end) return out;
    }
    const SkinDeformer deformer(s);
    std::vector<float> positions(3 * (end - first)), normals(s.normals.empty() ? 0 : positions.size());
    for (std::size_t v = first; v < end; ++v)
        deformer.deform(v, &positions[3 * (v - first)], normals.empty() ? nullptr : &normals[3 * (v - first)]);
    if (!earlier) {
        out.arrays.positions = Blob::of(std::span<const float>(positions));
        if (!normals.empty()) out.arrays.normals = Blob::of(std::span<const float>(normals));
        return out;
    }
    out.arrays.positions =
        *out.arrays.positions.withRange(3 * sizeof(float) * first, std::as_bytes(std::span<const float>(positions)));
    if (!normals.empty())
        out.arrays.normals =
            *out.arrays.normals.withRange(3 * sizeof(float) * first, std::as_bytes(std::span<const float>(normals)));
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
