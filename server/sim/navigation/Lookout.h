/// What somebody who steers asks of the scene. No frame waits for what takes long.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "server/collision/mesh/QueryWork.h"
#include "server/sim/navigation/Navigator.h"

namespace tessera {

class CollisionShape;
class Simulation;
struct PickHit;
struct UnmadeShape;

/// Has things done beside the frames; what they return is called on the frame thread in a later frame. Empty: all is
/// done at once.
struct LooksBeside {
    using Then = std::function<void()>;
    using Look = std::function<Then(const Aspect& scene)>;
    using Work = std::function<Then()>;
    std::function<void(Look)> look;
    std::function<void(Work)> work;
};
/// Of all that is drawn at and below a node (sceneBounds), of all of the scene where it is none. Empty: there is no such node.
[[nodiscard]] Box boundsOf(const Aspect& scene, ObjectId node);

/// Each question is asked again in each frame until it is answered; one that nobody asks in a frame is forgotten. Frame
/// thread only; lives as long as anybody may call back.
class Lookout {
public:
    /// As many faces and boxes one frame may look at: where there are more, a walker stays and nothing is hit.
    static constexpr std::uint64_t kMaxWork = 1'000'000;
    /// So often the geometry on a ray may change before its tree is there: then nothing is hit.
    static constexpr int kMostRounds = 64;

    Lookout(Simulation& simulation, LooksBeside beside) : simulation_(simulation), beside_(std::move(beside)) {}

    /// So many frames what was made is kept for the next question.
    static constexpr int kFramesHeld = 600;

    /// A new frame begins.
    void frame();
    /// Boxes and faces looked at in this frame.
    [[nodiscard]] std::uint64_t work() const { return work_; }

    // As NavigationScene has them.
    [[nodiscard]] bool facesIn(const Box& box, std::vector<Triangle>& faces);
    [[nodiscard]] std::optional<double> hit(const Ray& ray);
    [[nodiscard]] std::optional<Box> bounds(ObjectId node);
    [[nodiscard]] std::optional<Box> boundsAt(const Ray& ray);

private:
    struct Question {
        ObjectId node;
        std::optional<Box> box;
        bool asked = true;  ///< in this frame
    };
    /// Empty: not yet.
    [[nodiscard]] std::optional<std::optional<PickHit>> pick(const Ray& ray);
    [[nodiscard]] QueryWork workLeft() const { return {.limit = kMaxWork - std::min(work_, kMaxWork)}; }
    void wantMade(const UnmadeShape& unmade);

    Simulation& simulation_;
    LooksBeside beside_;
    std::optional<Question> bounds_;
    bool finding_ = false, making_ = false, picked_ = false;
    int unused_ = 0;                       ///< frames in which nobody looked at geometry
    int rounds_ = 0;                       ///< of the pick that is asked frame by frame
    std::deque<std::shared_ptr<const CollisionShape>> held_;  ///< the newest ones: the cache lets go of what nobody holds
    std::uint64_t work_ = 0;
};

}  // namespace tessera
