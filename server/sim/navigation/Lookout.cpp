#include "server/sim/navigation/Lookout.h"

#include <limits>

#include "common/drawable/SceneBounds.h"
#include "server/collision/pipeline/AsideQuery.h"
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
    if (unused_ > kFramesHeld && !held_.empty())
        letGo(std::make_shared<const decltype(held_)>(std::exchange(held_, {})));
    work_ = 0;
    if (bounds_ && !std::exchange(bounds_->asked, false)) bounds_.reset();
    if (hit_ && (!std::exchange(hit_->asked, false) || (hit_->answer && ++hit_->age > kFramesTrue))) hit_.reset();
}

void Lookout::letGo(std::shared_ptr<const void> with) {
    std::vector<std::shared_ptr<const CollisionShape>> gone = simulation_.takeReleased();
    if (!beside_.work || (gone.empty() && !with)) return;
    beside_.work([gone = std::move(gone), with = std::move(with)]() mutable -> LooksBeside::Then {
        gone.clear();
        with.reset();
        return [] {};
    });
}

void Lookout::makeBeside(const UnmadeShape& unmade) {
    if (std::exchange(making_, true)) return;
    beside_.work([this, unmade]() -> LooksBeside::Then {
        return [this, made = MadeShape{unmade, ShapeCache::make(unmade)}] {
            making_ = false;
            held_.push_back(made.shape);
            if (held_.size() > kMostHeld) held_.pop_front();
            simulation_.putShapes({made});
            letGo();
        };
    });
}

bool Lookout::facesIn(const Box& box, std::vector<Triangle>& faces) {
    QueryWork effort{.limit = kMaxWork - std::min(work_, kMaxWork)};
    PickPatience patience;
    const bool all = simulation_.facesIn(box, effort, faces, beside_.work ? &patience : nullptr);
    work_ += effort.boxTests + effort.triangleTests;
    if (patience.unmade) makeBeside(*patience.unmade);
    return all;
}

std::optional<Lookout::Hit> Lookout::pick(const Ray& ray) {
    if (hit_ && hit_->about == ray) {
        hit_->asked = true;
        if (hit_->answer) return hit_->answer;
        if (!picking_) findBeside(ray);
        return std::nullopt;
    }
    PickPatience patience{.work = {.limit = kMaxPickWork}};
    const Hit hit = simulation_.pick(ray, beside_.work ? &patience : nullptr);
    work_ += patience.work.boxTests + patience.work.triangleTests;
    letGo();
    if (!beside_.work || !patience.over()) return std::optional(hit);
    hit_ = HitQuestion{.about = ray};
    if (!picking_) findBeside(ray);
    return std::nullopt;
}

void Lookout::findBeside(const Ray& ray) {
    const auto question = std::make_shared<std::optional<AsidePick>>(simulation_.pickAside(ray));
    if (!*question) return static_cast<void>(hit_->answer.emplace());  // too much stands there: nothing is hit
    picking_ = true;
    beside_.work([this, ray, question]() -> LooksBeside::Then {
        (*question)->answer();
        return [this, ray, question]() mutable {
            picking_ = false;
            if (hit_ && hit_->about == ray) hit_->answer = (*question)->found;
            simulation_.putShapes(std::move((*question)->made));
            letGo(std::move(question));
        };
    });
}

std::optional<double> Lookout::hit(const Ray& ray) {
    const std::optional<Hit> found = pick(ray);
    if (!found) return std::nullopt;
    return *found ? (*found)->t : std::numeric_limits<double>::infinity();
}

std::optional<Box> Lookout::bounds(ObjectId node) {
    if (!beside_.look) return boundsOf(simulation_.scene(), node);
    if (bounds_ && bounds_->about == node && bounds_->answer) return std::exchange(bounds_, {})->answer;
    bounds_ = BoundsQuestion{.about = node};
    if (std::exchange(finding_, true)) return std::nullopt;
    beside_.look([this, node](const Aspect& scene) -> LooksBeside::Then {
        return [this, node, box = boundsOf(scene, node)] {
            finding_ = false;
            if (bounds_ && bounds_->about == node) bounds_->answer = box;
        };
    });
    return std::nullopt;
}

std::optional<Box> Lookout::boundsAt(const Ray& ray) {
    const std::optional<Hit> found = pick(ray);
    if (!found) return std::nullopt;
    return *found ? bounds((*found)->node) : Box();
}

}  // namespace tessera
