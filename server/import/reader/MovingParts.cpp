#include "server/import/reader/MovingParts.h"

#include <algorithm>
#include <cmath>

namespace tessera {

bool holdsSkinNumbers(std::span<const float> numbers) {
    return std::ranges::all_of(numbers, [](float number) { return std::abs(number) <= 1e15f; });
}

void appendMatrixRows(std::vector<float>& to, const Affine3d& matrix) {
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 4; ++c) to.push_back(static_cast<float>(matrix(r, c)));
}

void SkinInfluences::addVertex(std::vector<Influence>& all, std::uint32_t otherwise) {
    odd_ = odd_ ||
           std::ranges::any_of(all, [](const Influence& one) { return !std::isfinite(one.weight) || one.weight < 0; });
    std::erase_if(all, [](const Influence& one) { return !std::isfinite(one.weight) || one.weight <= 0; });
    std::ranges::stable_sort(all, [](const Influence& a, const Influence& b) { return a.weight > b.weight; });
    lost_ = lost_ || all.size() > 4;
    if (all.empty()) {
        hadNone_ = true;
        all.push_back({1.0f, otherwise});
    }
    // Weights count beside each other alone: a sum that is next to nothing would be none.
    if (const float most = all.front().weight; most < 1e-6f)
        for (Influence& one : all) one.weight /= most;
    all.resize(4, {0.0f, 0u});
    for (const Influence& one : all) {
        weights_.push_back(std::min(one.weight, 1e6f));
        joints_.push_back(static_cast<std::uint16_t>(one.joint));
    }
}

void SkinInfluences::write(proto::scene::Skin& skin) {
    if (odd_) scene_.note("weights of joints that are below zero or no numbers count as zero");
    if (lost_) scene_.note("of vertices that follow more than four joints the four strongest count");
    skin.set_joint_indices_blob(scene_.addBlob(bytesOfNumbers(joints_)));
    skin.set_joint_weights_blob(scene_.addBlob(bytesOfNumbers(weights_)));
}

void AnimationNodes::add(std::string name, proto::scene::Animation animation) {
    if (animation.channel().empty()) return;
    animation.set_paused(count_ > 0);
    ++count_;
    proto::scene::Node* node = scene_.addBeside();
    node->set_name(std::move(name));
    *node->mutable_animation() = std::move(animation);
}

void AnimationNodes::finish() {
    if (count_ > 1)
        scene_.note("of several animations, the first is played; the others stand until somebody plays them");
}

void mendRotationKey(PlainScene& scene, std::span<double, 4> key) {
    if (!std::ranges::all_of(key, [](double v) { return std::abs(v) < 1e-30; })) return;
    scene.note("a key of an animation is a rotation of length zero: it is none");
    key[0] = 1;
}

}  // namespace tessera
