#include "server/sim/navigation/Lookout.h"

#include <limits>

#include "common/drawable/SceneBounds.h"
#include "server/collision/pipeline/ScenePicker.h"
#include "server/sim/frame/Simulation.h"

namespace tessera {
namespace {

constexpr std::size_t kMostHeld = 16;

}  // namespace

Box boundsOf(const Aspect& scene, ObjectId node) {
    if (!node) return sceneBounds(scene);
    return scene.get<Node>(node) ? sceneBounds(scene, node) : Box();
}

void Lookout::frame() {
    unused_ = work_ > 0 ? 0 : unused_ + 1;
    if (unused_ > kFramesHeld) held_.clear();
    work_ = 0;
    if (!std::exchange(picked_, false)) rounds_ = 0;
    if (bounds_ && !std::exchange(bounds_->asked, false)) bounds_.reset();
}

void Lookout::wantMade(const UnmadeShape& unmade) {
    if (std::exchange(making_, true)) return;
    ++rounds_;
    beside_.work([this, unmade]() -> LooksBeside::Then {
        return [this, unmade, made = makeShape(unmade)] {
            making_ = false;
            simulation_.putShape(unmade, made);
            held_.push_back(made);
            if (held_.size() > kMostHeld) held_.pop_front();
        };
    });
}

bool Lookout::facesIn(const Box& box, std::vector<Triangle>& faces) {
    QueryWork effort = workLeft();
    PickPatience patience;
    const bool all = simulation_.facesIn(box, effort, faces, beside_.work ? &patience : nullptr);
    work_ += effort.boxTests + effort.triangleTests;
    if (patience.unmade) wantMade(*patience.unmade);
    return all;
}

std::optional<std::optional<PickHit>> Lookout::pick(const Ray& ray) {
    PickPatience patience{.work = workLeft()};
    const std::optional<PickHit> hit = simulation_.pick(ray, beside_.work ? &patience : nullptr);
    work_ += patience.work.boxTests + patience.work.triangleTests;
    picked_ = true;
    if (!patience.unmade || rounds_ >= kMostRounds) return std::optional(hit);
    wantMade(*patience.unmade);
    return std::nullopt;
}

std::optional<double> Lookout::hit(const Ray& ray) {
    const std::optional<std::optional<PickHit>> found = pick(ray);
    if (!found) return std::nullopt;
    return *found ? (*found)->t : std::numeric_limits<double>::infinity();
}

std::optional<Box> Lookout::bounds(ObjectId node) {
    if (!beside_.look) return boundsOf(simulation_.scene(), node);
    if (bounds_ && bounds_->node == node && bounds_->box) return std::exchange(bounds_, {})->box;
    bounds_ = Question{.node = node, .box = {}};
    if (std::exchange(finding_, true)) return std::nullopt;
    beside_.look([this, node](const Aspect& scene) -> LooksBeside::Then {
        return [this, node, box = boundsOf(scene, node)] {
            finding_ = false;
            if (bounds_ && bounds_->node == node) bounds_->box = box;
        };
    });
    return std::nullopt;
}

std::optional<Box> Lookout::boundsAt(const Ray& ray) {
    const std::optional<std::optional<PickHit>> found = pick(ray);
    if (!found) return std::nullopt;
    return *found ? bounds((*found)->node) : Box();
}

}  // namespace tessera
