/// A scene of bodies under our collision pipeline, driven as the frame loop drives it.
///
/// First everything is added, then `open` makes one change list of it; from then on only `frame` changes the scene.
#pragma once

#include <utility>
#include <vector>

#include "common/cores/CollisionObject.h"
#include "common/cores/Interest.h"
#include "common/scene/Aspect.h"
#include "server/collision/pipeline/CollisionPipeline.h"
#include "tests/bench/PipelineRace.h"
#include "tests/support/Models.h"

namespace tessera {

class Workers;

/// Pairs of bodies, each with the smaller number first, ascending.
using BodyPairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

/// What is asked of two groups.
struct SceneQuestion {
    std::int64_t mode = Interest::kPseudoDynamic;
    std::int64_t response = Interest::kReport;
    std::int64_t detail = Interest::kAllFaces;
};

class PipelineScene {
public:
    explicit PipelineScene(Workers* workers = nullptr);
    PipelineScene(Workers* workers, const CollisionLimits& limits);

    [[nodiscard]] std::uint32_t addShape(const MeshArrays3& arrays);
    /// A node whose children are objects, each for itself.
    [[nodiscard]] ObjectId addGroup(std::int64_t kind, std::int64_t shape,
                                    std::int64_t volume = CollisionObject::kAuto);
    /// A node that is nothing to collisions itself: for free bodies, which are objects of their own.
    [[nodiscard]] ObjectId addFolder();
    /// Bodies are numbered in the order in which they come.
    void addBody(ObjectId group, std::uint32_t shape, const Pose& pose);
    void addFreeBody(ObjectId folder, std::uint32_t shape, const Pose& pose, double mass,
                     const Vec3d& velocity = Vec3d::Zero());
    void addInterest(ObjectId object, ObjectId against, const SceneQuestion& question);
    void setGravity(const Vec3d& gravity);
    void open();
    /// In place of all that: a scene that is there already.
    void open(const ChangeList& scene) { apply(scene); }
    [[nodiscard]] const Aspect& aspect() const { return aspect_; }

    /// The Transform of a body, to be wished for.
    [[nodiscard]] ObjectId transformOf(std::uint32_t body) const { return bodies_[body].transform; }
    [[nodiscard]] Pose poseOf(std::uint32_t body) const;
    /// Nobody is asked: the bodies are where they are told to be. Not timed.
    void put(const std::vector<TentativeTransform>& poses);
    /// The vertices of a shape are elsewhere from the next frame on. That is told before its time begins.
    void deform(std::uint32_t shape, const std::vector<double>& positions);
    /// Of it the vertices from `first` on, by an edit of that range: xyz each.
    void deform(std::uint32_t shape, std::size_t first, const std::vector<float>& positions);
    /// A step, and what it accepts committed by one list of which the pipeline is told.
    FrameTimes frame(const std::vector<TentativeTransform>& wanted, const FrameClock& clock);

    /// Of the last frame.
    [[nodiscard]] const StepResult& result() const { return result_; }
    [[nodiscard]] BodyPairs touching() const;

private:
    struct Body {
        ObjectId transform, core;
    };

    [[nodiscard]] ObjectId create(ObjectType type);
    ObjectId createNode(ObjectId parent, ObjectId core);
    void setPose(ObjectId transform, const Pose& pose);
    ObjectId placeBody(ObjectId group, std::uint32_t shape, const Pose& pose, ObjectId core);
    [[nodiscard]] ChangeList listOf(const StepResult& result);
    void apply(const ChangeList& list);

    CollisionPipeline pipeline_;
    Aspect aspect_;
    ChangeListBuilder builder_;
    std::uint64_t nextId_ = kRootNode.value + 1;
    std::vector<ObjectId> shapes_;
    std::vector<Body> bodies_;
    std::vector<std::uint32_t> bodyOfNode_;  // by id
    StepResult result_;
};

}  // namespace tessera
