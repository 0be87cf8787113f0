#include "tests/bench/PipelineScene.h"

#include <algorithm>

#include "common/cores/Environment.h"
#include "common/cores/Geometry.h"
#include "common/cores/Transform.h"
#include "common/scene/FieldTable.h"

namespace tessera {

namespace {

constexpr std::uint32_t kNoBody = 0xffffffffu;

/// Nothing is to be left out of a measurement.
CollisionLimits noLimits() {
    CollisionLimits limits;
    limits.maxContacts = 10'000'000;
    limits.maxEvents = 10'000'000;
    limits.maxTests = ~std::uint64_t{0};
    return limits;
}

}  // namespace

PipelineScene::PipelineScene(Workers* workers) : PipelineScene(workers, noLimits()) {}

PipelineScene::PipelineScene(Workers* workers, const CollisionLimits& limits) : pipeline_(limits, workers) {}

ObjectId PipelineScene::create(ObjectType type) {
    const ObjectId id(nextId_++);
    builder_.create(id, type);
    return id;
}

ObjectId PipelineScene::createNode(ObjectId parent, ObjectId core) {
    const ObjectId id = create(typeOf<Node>());
    if (core) builder_.set(id, typeOf<Node>(), fieldId<&Node::core>, toValue(core));
    builder_.place(id, parent);
    return id;
}

std::uint32_t PipelineScene::addShape(const MeshArrays3& arrays) {
    const std::vector<float> positions(arrays.positions.begin(), arrays.positions.end());
    const ObjectId id = create(typeOf<Geometry>());
    builder_.set(id, typeOf<Geometry>(), fieldId<&Geometry::positions>, Blob::of(std::span<const float>(positions)));
    builder_.set(id, typeOf<Geometry>(), fieldId<&Geometry::indices>,
                 Blob::of(std::span<const std::uint32_t>(arrays.indices)));
    shapes_.push_back(id);
    return static_cast<std::uint32_t>(shapes_.size() - 1);
}

ObjectId PipelineScene::addGroup(std::int64_t kind, std::int64_t shape, std::int64_t volume) {
    const ObjectId node = addFolder();
    const ObjectId core = create(typeOf<CollisionObject>());
    builder_.set(core, typeOf<CollisionObject>(), fieldId<&CollisionObject::node>, toValue(node));
    builder_.set(core, typeOf<CollisionObject>(), fieldId<&CollisionObject::kind>, toValue(kind));
    builder_.set(core, typeOf<CollisionObject>(), fieldId<&CollisionObject::division>,
                 toValue(CollisionObject::kEachChild));
    builder_.set(core, typeOf<CollisionObject>(), fieldId<&CollisionObject::shape>, toValue(shape));
    builder_.set(core, typeOf<CollisionObject>(), fieldId<&CollisionObject::volume>, toValue(volume));
    createNode(kRootNode, core);
    return node;
}

ObjectId PipelineScene::addFolder() {
    return createNode(kRootNode, {});
}

void PipelineScene::setPose(ObjectId transform, const Pose& pose) {
    builder_.set(transform, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(pose.translation));
    builder_.set(transform, typeOf<Transform>(), fieldId<&Transform::rotation>, toValue(pose.rotation));
    builder_.set(transform, typeOf<Transform>(), fieldId<&Transform::scale>, toValue(pose.scale));
}

/// Contacts name the node that bears the geometry, events the topmost one.
ObjectId PipelineScene::placeBody(ObjectId group, std::uint32_t shape, const Pose& pose, ObjectId core) {
    const ObjectId transform = create(typeOf<Transform>());
    setPose(transform, pose);
    const ObjectId top = createNode(group, transform);
    const ObjectId bearer = createNode(top, shapes_[shape]);
    bodyOfNode_.resize(nextId_, kNoBody);
    bodyOfNode_[top.value] = bodyOfNode_[bearer.value] = static_cast<std::uint32_t>(bodies_.size());
    bodies_.push_back({transform, core});
    return top;
}

void PipelineScene::addBody(ObjectId group, std::uint32_t shape, const Pose& pose) {
    placeBody(group, shape, pose, {});
}

void PipelineScene::addFreeBody(ObjectId folder, std::uint32_t shape, const Pose& pose, double mass,
                                const Vec3d& velocity) {
    const ObjectId core = create(typeOf<CollisionObject>());
    const ObjectId node = placeBody(folder, shape, pose, core);
    builder_.set(core, typeOf<CollisionObject>(), fieldId<&CollisionObject::node>, toValue(node));
    builder_.set(core, typeOf<CollisionObject>(), fieldId<&CollisionObject::shape>, toValue(CollisionObject::kHull));
    builder_.set(core, typeOf<CollisionObject>(), fieldId<&CollisionObject::mass>, toValue(mass));
    builder_.set(core, typeOf<CollisionObject>(), fieldId<&CollisionObject::velocity>, toValue(velocity));
    createNode(kRootNode, core);
}

void PipelineScene::addInterest(ObjectId object, ObjectId against, const SceneQuestion& question) {
    const ObjectId core = create(typeOf<Interest>());
    builder_.set(core, typeOf<Interest>(), fieldId<&Interest::object>, toValue(object));
    builder_.set(core, typeOf<Interest>(), fieldId<&Interest::against>, toValue(against));
    builder_.set(core, typeOf<Interest>(), fieldId<&Interest::mode>, toValue(question.mode));
    builder_.set(core, typeOf<Interest>(), fieldId<&Interest::response>, toValue(question.response));
    builder_.set(core, typeOf<Interest>(), fieldId<&Interest::detail>, toValue(question.detail));
    createNode(kRootNode, core);
}

void PipelineScene::setGravity(const Vec3d& gravity) {
    const ObjectId core = create(typeOf<Environment>());
    builder_.set(core, typeOf<Environment>(), fieldId<&Environment::gravity>, toValue(gravity));
    createNode(kRootNode, core);
}

void PipelineScene::open() {
    bodyOfNode_.resize(nextId_, kNoBody);
    apply(builder_.take());
}

void PipelineScene::apply(const ChangeList& list) {
    const Expected<void> applied = aspect_.apply(list);
    TESSERA_CHECK(applied.has_value(), applied ? std::string() : applied.error().message);
    pipeline_.sceneChanged(aspect_, &list);
}

Pose PipelineScene::poseOf(std::uint32_t body) const {
    const Transform& t = *aspect_.get<Transform>(bodies_[body].transform);
    return {t.translation, t.rotation, t.scale};
}

void PipelineScene::put(const std::vector<TentativeTransform>& poses) {
    for (const TentativeTransform& t : poses) setPose(t.transform, {t.translation, t.rotation, t.scale});
    apply(builder_.take());
}

void PipelineScene::deform(std::uint32_t shape, const std::vector<double>& positions) {
    const std::vector<float> rounded(positions.begin(), positions.end());
    builder_.set(shapes_[shape], typeOf<Geometry>(), fieldId<&Geometry::positions>,
                 Blob::of(std::span<const float>(rounded)));
    apply(builder_.take());
}

void PipelineScene::deform(std::uint32_t shape, std::size_t first, const std::vector<float>& positions) {
    builder_.setRange(shapes_[shape], typeOf<Geometry>(), fieldId<&Geometry::positions>, 3 * sizeof(float) * first,
                      Blob::of(std::span<const float>(positions)));
    apply(builder_.take());
}

/// As the frame loop commits: fields that changed, and nothing else.
ChangeList PipelineScene::listOf(const StepResult& result) {
    for (const TentativeTransform& t : result.accepted) {
        const Transform& now = *aspect_.get<Transform>(t.transform);
        if (now.translation != t.translation)
            builder_.set(t.transform, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(t.translation));
        if (now.rotation.coeffs() != t.rotation.coeffs())
            builder_.set(t.transform, typeOf<Transform>(), fieldId<&Transform::rotation>, toValue(t.rotation));
        if (now.scale != t.scale)
            builder_.set(t.transform, typeOf<Transform>(), fieldId<&Transform::scale>, toValue(t.scale));
    }
    for (const BodyVelocity& v : result.velocities) {
        builder_.set(v.core, typeOf<CollisionObject>(), fieldId<&CollisionObject::velocity>, toValue(v.velocity));
        builder_.set(v.core, typeOf<CollisionObject>(), fieldId<&CollisionObject::spin>, toValue(v.spin));
    }
    return builder_.take();
}

FrameTimes PipelineScene::frame(const std::vector<TentativeTransform>& wanted, const FrameClock& clock) {
    FrameTimes times;
    result_ = {};  // nobody asks about the last frame any more
    times.asked = clock.seconds([&] { result_ = pipeline_.step(aspect_, wanted); });
    times.whole = times.asked + clock.seconds([&] {
        const ChangeList list = listOf(result_);
        if (!list.empty()) apply(list);
    });
    return times;
}

BodyPairs PipelineScene::touching() const {
    BodyPairs pairs;
    const auto add = [&](ObjectId a, ObjectId b) {
        pairs.push_back(std::minmax({bodyOfNode_[a.value], bodyOfNode_[b.value]}));
    };
    for (const Contact& c : result_.contacts) add(c.objectA, c.objectB);
    for (const PairEvent& e : result_.events)
        if (e.phase != Phase::kEnded) add(e.objectA, e.objectB);
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    return pairs;
}

}  // namespace tessera
