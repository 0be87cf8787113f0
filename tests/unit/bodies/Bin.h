/// A bin of free bodies in a simulation, and random edits of it by people.
#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "common/cores/CollisionObject.h"
#include "server/sim/frame/Simulation.h"
#include "tests/property/Seeds.h"

namespace tessera::test {

/// As what a body meets another one. Changed: in its mass, shape or kind.
enum class BodyState : std::uint8_t { kAsleep, kHeld, kMoved, kAnimated, kStatic, kRemoved, kChanged };
inline constexpr std::size_t kBodyStates = 7;

struct BinOptions {
    unsigned threads = 1;
    /// Each frame also says of every body that its friction is what it is: all are looked at anew.
    bool lookAtAll = false;
};

/// Forty bodies between five plates. The same seed gives the same edits for the same states of the scene.
class Bin {
public:
    explicit Bin(std::uint64_t seed, BinOptions options = {});

    /// All contacts of a crowded bin are listed.
    [[nodiscard]] static CollisionLimits limits() { return {.maxContacts = 1'000'000}; }

    /// A frame with some random edits, or with none while the bodies come to rest.
    FrameResult next();

    [[nodiscard]] const Aspect& scene() const { return simulation_.scene(); }
    [[nodiscard]] Simulation& simulation() { return simulation_; }
    [[nodiscard]] std::size_t edits() const { return edits_; }
    [[nodiscard]] std::size_t refused() const { return refused_; }
    /// How often two bodies were led to each other as what; the lower state first.
    using Meetings = std::map<std::pair<BodyState, BodyState>, std::size_t>;
    [[nodiscard]] const Meetings& meetings() const { return meetings_; }
    /// Fails the test where a number of the scene is none, or a body is faster than any may be.
    void expectSound() const;

private:
    struct Thing {
        ObjectId object, node, transform;
    };
    /// The bodies that a hand leads from frame to frame.
    struct Drag {
        ObjectId node;
        NodeMove by;
        int frames = 0;
        std::uint64_t gesture = 0;
    };

    void build();
    void look();
    void busyFrame();
    void addBody(ChangeListBuilder& list, ObjectId parent, const Vec3d& at);
    ObjectId addNode(ChangeListBuilder& list, ObjectId parent, ObjectId core);

    void submit(Edit edit);
    void submit(ChangeListBuilder& list) { submit(Edit{.list = list.take()}); }
    void move(ObjectId node, const NodeMove& by);
    void drag(const Thing& thing, const NodeMove& by, int frames);

    void meet();
    [[nodiscard]] Thing inState(BodyState state);
    void lead(const Thing& thing, BodyState as, const Thing& to);
    void remove(const Thing& thing);
    void animate(const Thing& thing, const Vec3d& to);
    void change(const Thing& thing);

    void editAny();
    void editPlace(const Thing& thing);
    void editTree(const Thing& thing);
    void editSurroundings();
    /// So that bodies can come to rest: nothing is driven, and what lies in the bin is of common sizes and masses.
    void tidyUp();

    [[nodiscard]] std::vector<ObjectId> all(ObjectType type) const;
    [[nodiscard]] ObjectId some(ObjectType type);
    [[nodiscard]] Thing anyThing();
    [[nodiscard]] bool asleep(const Thing& thing) const;
    /// Where the middle of one is, in the coordinates in which the other one is placed.
    [[nodiscard]] Vec3d seenFrom(const Thing& one, const Thing& other) const;
    [[nodiscard]] double number(double low, double high);
    [[nodiscard]] Vec3d vector(double most);
    [[nodiscard]] Quatd turn();
    [[nodiscard]] double extreme();

    Random random_;
    BinOptions options_;
    Simulation simulation_;
    std::vector<Thing> things_;
    std::vector<Edit> frame_;
    std::vector<Drag> drags_;
    std::uint64_t placeholder_ = 0, gesture_ = 0;
    std::size_t edits_ = 0, refused_ = 0;
    int quiet_ = 0, busy_ = 0;
    Meetings meetings_;
};

}  // namespace tessera::test
