/// What moves, in plain form: what the readers of glTF and of assimp's formats have in common.
#pragma once

#include <cstring>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "server/import/reader/PlainScene.h"

namespace tessera {

/// More are no animation: a channel of a file that has them is refused or left out.
inline constexpr std::size_t kMaxKeysPerChannel = 1'000'000;
/// Targets × vertices of a mesh.
inline constexpr std::size_t kMaxMorphVertices = 100'000'000;

template <typename Number>
[[nodiscard]] Bytes bytesOfNumbers(const std::vector<Number>& numbers) {
    Bytes bytes(numbers.size() * sizeof(Number));
    if (!bytes.empty()) std::memcpy(bytes.data(), numbers.data(), bytes.size());
    return bytes;
}

/// Finite, and not beyond 1e15 either way: what a Skin may hold.
[[nodiscard]] bool holdsSkinNumbers(std::span<const float> numbers);
/// Row by row, as a Skin has matrices.
void appendMatrixRows(std::vector<float>& to, const Affine3d& matrix);

struct Influence {
    float weight = 0;
    std::uint32_t joint = 0;
};

/// Which joints move the vertices of one mesh, and how much: of each vertex the four strongest.
class SkinInfluences {
public:
    explicit SkinInfluences(PlainScene& scene) : scene_(scene) {}

    /// Of the next vertex. Weights that are no numbers or not above 0 count as none; whoever has no other follows
    /// `otherwise`.
    void addVertex(std::vector<Influence>& all, std::uint32_t otherwise);
    /// Whether a vertex has followed `otherwise`.
    [[nodiscard]] bool hadNone() const { return hadNone_; }
    void write(proto::scene::Skin& skin);

private:
    PlainScene& scene_;
    std::vector<std::uint16_t> joints_;
    std::vector<float> weights_;
    bool lost_ = false, odd_ = false, hadNone_ = false;
};

/// The animations of a file: nodes at its top, of which the first plays. One without channels is none.
class AnimationNodes {
public:
    explicit AnimationNodes(PlainScene& scene) : scene_(scene) {}
    void add(std::string name, proto::scene::Animation animation);
    void finish();

private:
    PlainScene& scene_;
    std::size_t count_ = 0;
};

/// A quaternion of length zero turns nothing, which is said. In and out: w x y z.
void mendRotationKey(PlainScene& scene, std::span<double, 4> key);

}  // namespace tessera
