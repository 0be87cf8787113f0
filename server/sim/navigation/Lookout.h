/// What somebody who steers asks of the scene. No frame waits for what takes long.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "server/collision/pipeline/SceneHits.h"
#include "server/sim/navigation/Navigator.h"

namespace tessera {

class Simulation;

/// Has things done beside the frames; what they return is called on the frame thread in a later frame. Empty: all is
/// done at once.
struct LooksBeside {
    using Then = std::function<void()>;
    using Look = std::function<Then(const Aspect& scene)>;
    using Work = std::function<Then()>;
    std::function<void(Look)> look;
    std::function<void(Work)> work;
};
/// Of all that is drawn at and below a node (sceneBounds), of all of the scene where it is none. Empty: there is no
/// such node.
[[nodiscard]] Box boundsOf(const Aspect& scene, ObjectId node);

/// Each question is asked again in each frame until it is answered; one that nobody asks in a frame is forgotten. Frame
/// thread only; lives as long as anybody may call back.
class Lookout {
public:
    /// As many faces and boxes one frame may look at for a walker: among more he stays where he is. And for a ray; what
    /// takes more is found beside the frames.
    static constexpr std::uint64_t kMaxWork = 1'000'000, kMaxPickWork = 20'000;
    /// So many frames what a walker needed is kept for his next step.
    static constexpr int kFramesHeld = 600;
    /// So long an answer about a ray counts, where it is asked in each frame.
    static constexpr int kFramesTrue = 30;

    Lookout(Simulation& simulation, LooksBeside beside) : simulation_(simulation), beside_(std::move(beside)) {}

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
    using Hit = std::optional<PickHit>;
    // Each asked in this frame or the last one.
    struct BoundsQuestion {
        ObjectId about;
        std::optional<Box> answer = {};
        bool asked = true;
    };
    struct HitQuestion {
        Ray about;
        std::optional<Hit> answer = {};
        bool asked = true;
        int age = 0;  ///< of the answer, frames
    };
    /// Empty: not yet.
    [[nodiscard]] std::optional<Hit> pick(const Ray& ray);
    void findBeside(const Ray& ray);
    void makeBeside(const UnmadeShape& unmade);
    /// Lets go of what is kept for picks no more, and of this, beside the frames: that takes as long as one.
    void letGo(std::shared_ptr<const void> with = {});

    Simulation& simulation_;
    LooksBeside beside_;
    std::optional<BoundsQuestion> bounds_;
    std::optional<HitQuestion> hit_;
    bool finding_ = false, picking_ = false, making_ = false;
    int unused_ = 0;                                          ///< frames in which nobody looked at geometry
    std::deque<std::shared_ptr<const CollisionShape>> held_;  ///< the newest ones that a walker needed
    std::uint64_t work_ = 0;
};

}  // namespace tessera
